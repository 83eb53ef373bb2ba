// What landmarks teach about the sessions of a map.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "localization/pose_verifier.h"
#include "test/localization/street_map.h"
#include "test/support/stamps.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

constexpr std::int64_t kEvening_ns = 36'000 * kSecond_ns;

/// The street on two days; on the first one, in the morning, half of its landmarks were seen.
std::shared_ptr<const TrainingMap> twoDays(const TrainingMap& street) {
  MapHeader header = street.header();
  header.sessions = {header.sessions.front(), header.sessions.front()};
  header.sessions[1].name = "evening";
  std::vector<TrainingImage> images;
  for (int session = 0; session < 2; ++session) {
    for (std::size_t i = 0; i < street.size(); ++i) {
      TrainingImage image = street.image(i);
      image.session = session;
      image.stamp_ns = session * kEvening_ns + static_cast<std::int64_t>(i) * kSecond_ns;
      std::vector<SeenLandmark> seen;
      for (const SeenLandmark& landmark : image.geometry->landmarks) {
        if (session == 1 || landmark.id % 2 == 0) seen.push_back(landmark);
      }
      image.geometry->landmarks = seen;
      images.push_back(std::move(image));
    }
  }
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

class SessionTrial : public testing::Test {
 protected:
  /// So many inliers make a pose `TRACKING`.
  static MetricConfig withTracking(std::size_t min_inliers) {
    MetricConfig config;
    config.min_inliers_tracking = static_cast<int>(min_inliers);
    return config;
  }
  /// Image by image along the street, beginning at this time: the session that is chosen after each.
  std::vector<std::size_t> chosenOnTheWay(std::int64_t begin_ns, std::size_t images) {
    std::vector<std::size_t> chosen;
    for (std::size_t i = 10; i < 10 + images; ++i) {
      const std::int64_t stamp_ns = begin_ns + static_cast<std::int64_t>(i) * kSecond_ns;
      const LocalFeatures seen = street_.seenFrom(street_.trueNear(i, Eigen::Vector3d::Zero()));
      sessions_.startImage(stamp_ns);
      verifier_.startImage(stamp_ns, seen, street_.camera());
      std::optional<MetricPose> pose = verifier_.nearPrediction();
      if (!pose) pose = verifier_.nearOneOf({*sessions_.chosen() * street_.map().size() + i});
      EXPECT_TRUE(pose) << i;
      chosen.push_back(*sessions_.chosen());
    }
    return chosen;
  }

  test::StreetMap street_;
  std::shared_ptr<const TrainingMap> map_ = twoDays(street_.map());
  SessionChoice sessions_{*map_, true};
  PoseVerifier verifier_{*map_, {}, sessions_};
};

TEST_F(SessionTrial, TheSessionThatShowsMoreInliersIsChosen) {
  verifier_.configure(withTracking(1));
  EXPECT_EQ(chosenOnTheWay(0, 6), (std::vector<std::size_t>{0, 0, 0, 1, 1, 1})) << "the fourth image is a trial";
}

TEST_F(SessionTrial, WhereAllJoinTheSessionThatShowsMostInliersIsChosen) {
  EXPECT_EQ(chosenOnTheWay(0, 2), (std::vector<std::size_t>{1, 1}));
}

TEST_F(SessionTrial, TheSessionThatShowsFewerInliersIsNot) {
  EXPECT_EQ(chosenOnTheWay(kEvening_ns, 12), std::vector<std::size_t>(12, 1));
}

/// Its landmarks are those of the map, and yet it looks like no training image.
class UnlikeImage final : public test::FakeImage {
 public:
  explicit UnlikeImage(const TrainingMap& map) : seen(map) {}
  Score compare(FeatureKind kind, std::size_t i) override {
    Score score = seen.compare(kind, i);
    score.recognised = false;
    return score;
  }
  const LocalFeatures* unprunedLocal() override { return seen.unprunedLocal(); }

  test::GivenImage seen;
};

TEST_F(SessionTrial, WhereAPoseIsVerifiedTheSessionStaysThoughNothingLooksAlike) {
  const auto image = std::make_shared<UnlikeImage>(*map_);
  Localizer localizer(map_, {}, image);
  for (std::size_t i = 10; i < 30; ++i) {
    image->seen.features = street_.seenFrom(street_.trueNear(i, Eigen::Vector3d::Zero()));
    const Estimate estimate = localizer.process(kEvening_ns + static_cast<std::int64_t>(i) * kSecond_ns, cv::Mat());
    ASSERT_TRUE(estimate.metric) << i;
    ASSERT_FALSE(estimate.tracked.best.recognised) << i;
    EXPECT_EQ(estimate.session, "evening") << i;
  }
}

/// Near training image 20, which both sessions have.
class SessionsTogether : public SessionTrial {
 protected:
  std::optional<MetricPose> poseLike(std::size_t training_image, const MetricConfig& config = {}) {
    verifier_.configure(config);
    verifier_.reset();
    verifier_.startImage(0, seen_, street_.camera());
    return verifier_.nearOneOf({training_image});
  }
  std::size_t inliersLike(std::size_t training_image, const MetricConfig& config = {}) {
    const auto pose = poseLike(training_image, config);
    return pose ? pose->inliers : 0;
  }
  const std::size_t morning_ = 20;
  const std::size_t evening_ = street_.map().size() + 20;
  const LocalFeatures seen_ = street_.seenFrom(street_.trueNear(20, Eigen::Vector3d::Zero()));
  const std::size_t of_morning_ = inliersLike(morning_, withTracking(1));
  const std::size_t of_evening_ = inliersLike(evening_, withTracking(1));
};

TEST_F(SessionsTogether, WhereOneShowsTooFewLandmarksThoseOfAllAreTried) {
  ASSERT_GT(of_morning_, 0U);
  ASSERT_GT(of_evening_, of_morning_);
  MetricConfig config = withTracking(1);
  config.min_inliers = static_cast<int>(of_morning_) + 1;
  EXPECT_GT(inliersLike(morning_, config), of_morning_);
}

TEST_F(SessionsTogether, OneIsEnoughWhereItMakesThePoseTracking) {
  const auto pose = poseLike(morning_, withTracking(of_morning_));
  ASSERT_TRUE(pose);
  EXPECT_TRUE(pose->confirmed);
  EXPECT_EQ(pose->inliers, of_morning_);
  for (const std::size_t image : verifier_.compared()) EXPECT_LT(image, street_.map().size());
}

TEST_F(SessionsTogether, WhereTooFewLandmarksAgreeForTrackingThoseOfAllJoin) {
  const auto pose = poseLike(morning_, withTracking(of_morning_ + 1));
  ASSERT_TRUE(pose);
  EXPECT_TRUE(pose->confirmed);
  EXPECT_GT(pose->inliers, of_morning_);
}

TEST_F(SessionsTogether, TooFewOfAllAreNotTracking) {
  const auto pose = poseLike(morning_, withTracking(10'000));
  ASSERT_TRUE(pose);
  EXPECT_FALSE(pose->confirmed);
}

TEST_F(SessionsTogether, ShowNoKeypointTwice) {
  EXPECT_LE(inliersLike(morning_, withTracking(10'000)), of_evening_ + 2) << "the evening has all of the morning's";
}

/// The evening's landmarks agree with a pose elsewhere and say themselves that they are known to metres only: the pose
/// that they make is refused.
class RefusedRetry : public SessionTrial {
 protected:
  static std::shared_ptr<const TrainingMap> withVagueEvening(const TrainingMap& days) {
    std::vector<TrainingImage> images;
    for (std::size_t i = 0; i < days.size(); ++i) {
      images.push_back(days.image(i));
      ImageGeometry& geometry = *images.back().geometry;
      if (images.back().session == 0) continue;
      geometry.camera.position_m += Eigen::Vector3d(10.0, 5.0, 0.0);
      for (SeenLandmark& landmark : geometry.landmarks) landmark.sigma_along_m = landmark.sigma_across_m = 5.0F;
    }
    return std::make_shared<const TrainingMap>(days.header(), std::move(images));
  }

  const std::size_t image_ = 20;
  std::shared_ptr<const TrainingMap> vague_ = withVagueEvening(*map_);
  SessionChoice sessions_of_vague_{*vague_, true};
  PoseVerifier verifier_of_vague_{*vague_, withTracking(10'000), sessions_of_vague_};
};

TEST_F(RefusedRetry, LeavesNothingBehind) {
  const LocalFeatures seen = street_.seenFrom(street_.trueNear(image_, Eigen::Vector3d::Zero()));
  sessions_of_vague_.startImage(0);
  verifier_of_vague_.startImage(0, seen, street_.camera());
  EXPECT_FALSE(verifier_of_vague_.nearOneOf({vague_->size() / 2 + image_})) << "the evening alone";
  EXPECT_TRUE(verifier_of_vague_.matched().landmarks.empty());
  EXPECT_EQ(sessions_of_vague_.chosen(), 0U);

  const std::optional<MetricPose> pose = verifier_of_vague_.nearOneOf({image_});
  ASSERT_TRUE(pose);
  const Eigen::Vector3d expected_m = vague_->geometry(image_)->camera.position_m;
  EXPECT_LT((pose->camera.position_m - expected_m).norm(), 0.1);
  const MatchedLandmarks& matched = verifier_of_vague_.matched();
  EXPECT_LT(matched.training_image, vague_->size() / 2) << "of the morning, whose pose it is";
  const auto inliers = std::count_if(matched.landmarks.begin(), matched.landmarks.end(),
                                     [](const MatchedLandmark& landmark) { return landmark.inlier; });
  EXPECT_GT(inliers, 10);
  EXPECT_EQ(sessions_of_vague_.chosen(), 0U);
  const std::vector<std::size_t> compared = verifier_of_vague_.compared();
  EXPECT_GE(*std::max_element(compared.begin(), compared.end()), vague_->size() / 2) << "the evening was tried";
}

}  // namespace
}  // namespace visual_localization
