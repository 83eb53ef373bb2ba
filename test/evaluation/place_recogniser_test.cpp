#include "evaluation/place_recogniser.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/evaluation/place_rows.h"
#include "test/support/refusal.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// What holds for every place recogniser, on open and on closed routes.
class EveryRecogniser : public ::testing::TestWithParam<std::tuple<std::string, bool>> {
 protected:
  bool closed() const { return std::get<1>(GetParam()); }
  std::unique_ptr<PlaceRecogniser> make() const { return makePlaceRecogniser(std::get<0>(GetParam()), {}, closed()); }
};

TEST_P(EveryRecogniser, FollowsTheDiagonalThroughNoise) {
  std::mt19937 generator(7);
  const auto recogniser = make();
  for (std::size_t image = 0; image < 60; ++image) {
    const Recognition answer = recogniser->update(test::noisy(test::rowAt(image, 60, closed()), 0.05, generator));
    EXPECT_EQ(answer.training_image, image);
  }
}

TEST_P(EveryRecogniser, SmallMapsHaveAnswersToo) {
  for (std::size_t images : {1u, 2u, 3u, 5u}) {
    const auto recogniser = make();
    for (std::size_t step = 0; step < 15; ++step) {
      const Recognition answer = recogniser->update(test::rowAt(images - 1, images, false));
      EXPECT_LT(answer.training_image, images);
      EXPECT_TRUE(std::isfinite(answer.confidence)) << images;
    }
  }
}

TEST_P(EveryRecogniser, KnowsTheSecondOfTwoImages) {
  const auto recogniser = make();
  recogniser->update({0.5, 0.1});
  EXPECT_EQ(recogniser->update({0.1, 0.5}).training_image, 1u);
}

TEST_P(EveryRecogniser, DarknessIsSurvived) {
  const auto recogniser = make();
  const std::vector<double> dark(60, 0.0);
  for (std::size_t step = 0; step < 15; ++step) {
    const Recognition answer = recogniser->update(dark);
    EXPECT_LT(answer.training_image, 60u);
    EXPECT_TRUE(std::isfinite(answer.confidence));
  }
  EXPECT_EQ(test::drive(*recogniser, 20, 20, 60, closed()).training_image, 39u);
}

TEST_P(EveryRecogniser, SharesNothingWithOthersOfItsKind) {
  std::mt19937 generator(11);
  const auto alone = make();
  std::vector<Recognition> expected;
  for (std::size_t step = 0; step < 12; ++step) expected.push_back(alone->update(test::rowAt(5 + step, 60, closed())));
  const auto other = make();
  const auto beside = make();
  for (std::size_t step = 0; step < 12; ++step) {
    other->update(test::noisy(test::rowAt(30 + step, 60, closed()), 0.4, generator));
    const Recognition answer = beside->update(test::rowAt(5 + step, 60, closed()));
    EXPECT_EQ(answer.training_image, expected[step].training_image);
    EXPECT_EQ(answer.confidence, expected[step].confidence);
  }
}

TEST_P(EveryRecogniser, RefusesRowsThatItCannotJudgeAndGoesOn) {
  const auto recogniser = make();
  EXPECT_THROW(recogniser->update({}), std::invalid_argument);
  const auto undisturbed = make();
  EXPECT_EQ(recogniser->update({0.5, 0.1, 0.2}).training_image, undisturbed->update({0.5, 0.1, 0.2}).training_image);
  EXPECT_THROW(recogniser->update({0.1, 0.5}), std::invalid_argument);
  EXPECT_THROW(recogniser->update({0.1, std::nan(""), 0.2}), std::invalid_argument);
  EXPECT_THROW(recogniser->update({0.1, -0.1, 0.2}), std::invalid_argument);
  EXPECT_THROW(recogniser->update({0.1, 1.1, 0.2}), std::invalid_argument);
  const Recognition expected = undisturbed->update({0.1, 0.5, 0.2});
  const Recognition answer = recogniser->update({0.1, 0.5, 0.2});
  EXPECT_EQ(answer.training_image, 1u);
  EXPECT_EQ(answer.confidence, expected.confidence);
}

INSTANTIATE_TEST_SUITE_P(Names, EveryRecogniser,
                         ::testing::Combine(::testing::ValuesIn(placeRecogniserNames()), ::testing::Bool()),
                         [](const auto& combination) {
                           return std::get<0>(combination.param) +
                                  (std::get<1>(combination.param) ? "_closed" : "_open");
                         });

TEST(BestSingleImage, TakesTheFirstOfEqualsAndIsAsSureAsTheyAreSimilar) {
  const auto recogniser = makePlaceRecogniser("exhaustive", {}, false);
  const Recognition answer = recogniser->update({0.1, 0.4, 0.2, 0.4});
  EXPECT_EQ(answer.training_image, 1u);
  EXPECT_EQ(answer.confidence, 0.4);
}

TEST(PlaceRecogniserFactory, UnknownNameIsRefusedWithThoseAllowed) {
  const std::string refusal = test::refusalOf<std::invalid_argument>([&] { makePlaceRecogniser("seqslam", {}, true); });
  EXPECT_THAT(refusal, HasSubstr("'seqslam'"));
  EXPECT_THAT(refusal, HasSubstr("exhaustive, sequence, topological"));
}

TEST(PlaceRecogniserConfig, DefaultsAreValidAndEveryFieldIsDeclared) {
  PlaceRecogniserConfig config;
  EXPECT_THAT(violationsOf(config), IsEmpty());
  EXPECT_THAT(parameters::values([&config](ParameterVisitor& visitor) { config.declare(visitor); }), SizeIs(12));
}

TEST(PlaceRecogniserConfig, SaysWhatIsWrong) {
  PlaceRecogniserConfig config;
  config.sequence.length = 0;
  config.sequence.min_speed = 2.0;
  config.bayes.min_step = 1;
  config.bayes.window = 4;
  EXPECT_THAT(violationsOf(config), SizeIs(4));
  EXPECT_THROW(makePlaceRecogniser("exhaustive", config, true), std::invalid_argument);
  PlaceRecogniserConfig read;
  EXPECT_THROW(assignParameters(read, {{"bayes/window", std::int64_t{4}}}), ParameterError);
  assignParameters(read, {{"bayes/window", std::int64_t{3}}, {"sequence/length", std::int64_t{4}}});
  EXPECT_EQ(read.bayes.window, 3);
  EXPECT_EQ(read.sequence.length, 4);
}

}  // namespace
}  // namespace visual_localization
