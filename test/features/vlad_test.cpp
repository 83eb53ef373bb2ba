#include "visual_localization/features/vlad.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

const cv::Size kSize(320, 240);
constexpr std::size_t kFeatures = 60;

/// Places of which each shows things of its own, out of a common stock of looks.
template <class Element>
class Places {
 public:
  Places(std::size_t places, std::size_t dimension) : dimension_(dimension), places_(places) {
    for (std::size_t place = 0; place < places; ++place) {
      std::mt19937 random(static_cast<unsigned>(place) + 1);
      std::uniform_int_distribution<int> value(0, 100);
      for (std::size_t i = 0; i < kFeatures; ++i) {
        places_[place].push_back(
            {{static_cast<float>(value(random)) * 3.2F, static_cast<float>(value(random)) * 2.4F, 4.0F, 0.0F}, {}});
        // Some looks are common, so that there are words.
        const int look = value(random) % 8;
        for (std::size_t d = 0; d < dimension; ++d) {
          const int common = static_cast<int>(d % 8) == look ? 100 : 0;
          places_[place].back().descriptor.push_back(common + value(random));
        }
      }
    }
  }

  /// What an image at a place shows; `noise`: of each element of its descriptors, of some 100.
  std::shared_ptr<const LocalFeatures> view(std::size_t place, int noise = 0, unsigned seed = 1,
                                            bool mirrored = false) const {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> off(-noise, noise);
    std::vector<Keypoint> keypoints;
    std::vector<Element> descriptors;
    for (const Thing& thing : places_[place]) {
      keypoints.push_back(thing.keypoint);
      if (mirrored) keypoints.back().x_px = static_cast<float>(kSize.width) - keypoints.back().x_px;
      for (const int value : thing.descriptor) {
        descriptors.push_back(static_cast<Element>(std::clamp(value + off(random), 0, 255)));
      }
    }
    return std::make_shared<LocalFeatures>(Keypoints(keypoints), std::move(descriptors));
  }

  std::shared_ptr<const VladVocabulary> learn() const {
    return VladVocabulary::learn(
        places_.size(), [this](std::size_t i) { return view(i); }, kSize);
  }
  std::size_t size() const { return places_.size(); }

 private:
  struct Thing {
    Keypoint keypoint;
    std::vector<int> descriptor;
  };
  std::size_t dimension_;
  std::vector<std::vector<Thing>> places_;
};

template <class Element>
void expectEachIsMostLikeItself(const Places<Element>& places) {
  const auto vocabulary = places.learn();
  ASSERT_TRUE(vocabulary);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const VladDescriptor query = vocabulary->describe(*places.view(i, 40, 7));
    const double here = vladSimilarity(query, vocabulary->describe(*places.view(i)));
    for (std::size_t other = 0; other < places.size(); ++other) {
      if (other == i) continue;
      EXPECT_LT(vladSimilarity(query, vocabulary->describe(*places.view(other))), here) << i << " and " << other;
    }
  }
}

TEST(Vlad, FindsAPlaceInNoiseByBytes) { expectEachIsMostLikeItself(Places<std::uint8_t>(40, kSiftDimension)); }

TEST(Vlad, FindsAPlaceInNoiseByFloatsOfAnyDimension) {
  expectEachIsMostLikeItself(Places<float>(40, 64));
  expectEachIsMostLikeItself(Places<float>(40, 20));
}

TEST(Vlad, IsTheSameForTheSameImages) {
  const Places<std::uint8_t> places(20, kSiftDimension);
  cv::theRNG() = cv::RNG(5);
  const auto first = places.learn();
  const auto drawn = cv::theRNG()();
  cv::theRNG() = cv::RNG(5);
  EXPECT_EQ(drawn, cv::theRNG()());  // the program's generator is as before
  cv::theRNG() = cv::RNG(6);
  const auto second = places.learn();
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(first->describe(*places.view(i)), second->describe(*places.view(i)));
  }
}

TEST(Vlad, DoesNotDependOnTheOrderOfFeaturesOrTheLengthOfDescriptors) {
  const Places<float> places(20, 64);
  const auto vocabulary = places.learn();
  const auto view = places.view(3);
  std::vector<std::size_t> reversed(view->size());
  for (std::size_t i = 0; i < reversed.size(); ++i) reversed[i] = reversed.size() - 1 - i;
  std::vector<float> twice = view->floats();
  for (float& value : twice) value *= 2.0F;
  const VladDescriptor descriptor = vocabulary->describe(*view);
  EXPECT_GT(vladSimilarity(descriptor, vocabulary->describe(view->subset(reversed))), 0.99);
  EXPECT_GT(vladSimilarity(descriptor, vocabulary->describe(LocalFeatures(view->keypoints(), twice))), 0.99);
}

TEST(Vlad, TellsTheSameThingsInAnotherLayout) {
  const Places<std::uint8_t> places(80, kSiftDimension);
  const auto vocabulary = places.learn();
  const VladDescriptor descriptor = vocabulary->describe(*places.view(3));
  EXPECT_GT(vladSimilarity(descriptor, descriptor), 0.95);
  constexpr double kFiveSigmas = 0.8;  // of the cosine of unrelated vectors of 40 elements, 1 / sqrt(40)
  EXPECT_LT(vladSimilarity(descriptor, vocabulary->describe(*places.view(3, 0, 1, true))), kFiveSigmas);
}

TEST(Vlad, HasAByteForEveryTwoImagesUpTo256) {
  EXPECT_EQ(Places<std::uint8_t>(20, kSiftDimension).learn()->bytes(), 10U);
  EXPECT_EQ(Places<std::uint8_t>(600, kSiftDimension).learn()->bytes(), 256U);
}

TEST(Vlad, KnowsNothingOfAnImageWithoutFeatures) {
  const Places<std::uint8_t> places(20, kSiftDimension);
  const auto vocabulary = places.learn();
  const VladDescriptor nothing = vocabulary->describe({});
  EXPECT_EQ(nothing, VladDescriptor(vocabulary->bytes(), 0));
  EXPECT_EQ(vladSimilarity(nothing, vocabulary->describe(*places.view(3))), 0.0);
  EXPECT_EQ(vladSimilarity({}, {}), 0.0);
}

TEST(Vlad, IsLearntOfImagesThatAreAllAlike) {
  const Places<std::uint8_t> places(1, kSiftDimension);
  const auto vocabulary = VladVocabulary::learn(
      20, [&](std::size_t) { return places.view(0); }, kSize);
  ASSERT_TRUE(vocabulary);
  EXPECT_EQ(vocabulary->describe(*places.view(0)).size(), 10U);
}

TEST(Vlad, IsNotLearntOfTooLittle) {
  const Places<std::uint8_t> places(20, kSiftDimension);
  EXPECT_FALSE(VladVocabulary::learn(
      1, [&](std::size_t i) { return places.view(i); }, kSize));
  EXPECT_FALSE(VladVocabulary::learn(
      20, [](std::size_t) { return std::make_shared<LocalFeatures>(); }, kSize));
}

TEST(Vlad, RefusesWhatDoesNotFit) {
  const auto vocabulary = Places<std::uint8_t>(20, kSiftDimension).learn();
  EXPECT_THROW(vocabulary->describe(*Places<float>(1, 64).view(0)), std::invalid_argument);
  VladVocabulary::Tables tables = vocabulary->tables();
  EXPECT_NO_THROW(VladVocabulary(tables, kSize));
  EXPECT_THROW(VladVocabulary(tables, {}), std::invalid_argument);
  tables.mean[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(VladVocabulary(tables, kSize), std::invalid_argument);
  tables = vocabulary->tables();
  tables.scales.conservativeResize(tables.scales.size() - 1);
  EXPECT_THROW(VladVocabulary(tables, kSize), std::invalid_argument);
  tables = vocabulary->tables();
  tables.components.conservativeResize(tables.components.rows() - 1, Eigen::NoChange);
  EXPECT_THROW(VladVocabulary(tables, kSize), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization
