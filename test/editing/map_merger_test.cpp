#include "editing/map_merger.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/editing/edited_street.h"
#include "test/support/example_map.h"
#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using test::EditedStreet;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

std::shared_ptr<const TrainingMap> changed(const TrainingMap& map, MapHeader header, std::int64_t later_ns = 0) {
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < map.size(); ++i) {
    images.push_back(map.image(i));
    images.back().stamp_ns += later_ns;
  }
  return std::make_shared<const TrainingMap>(std::move(header), std::move(images));
}

class MapMerger : public testing::Test {
 protected:
  std::shared_ptr<const TrainingMap> merged(const std::vector<NamedMap>& maps) {
    report_ = mergeMaps(maps, "merged by a test", path_, 2);
    checkMap(path_);
    return loadMap(path_);
  }

  std::string refusal(const std::vector<NamedMap>& maps) {
    const std::string text = test::refusalOf<MergeError>([&] { mergeMaps(maps, "", path_, 1); });
    EXPECT_FALSE(std::filesystem::exists(path_));
    return text;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "merged.map";
  EditedStreet street_;
  std::vector<MergedMap> report_;
};

TEST_F(MapMerger, TheFirstMapStaysAndTheOthersLieBesideIt) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0});
  const auto second = street_.mapOfDay(1, {1.5, -1.0});
  const auto map = merged({{"a.map", first}, {"b.map", second}});
  ASSERT_EQ(map->size(), first->size() + second->size());
  EXPECT_EQ(map->header().sessions[0].name, "day0");
  EXPECT_EQ(map->header().sessions[1].name, "day1");
  EXPECT_THAT(map->header().history, ElementsAre("merged by a test"));
  for (std::size_t i = 0; i < first->size(); ++i) {
    EXPECT_EQ(map->position_m(i), first->position_m(i));
    EXPECT_EQ(map->geometry(i)->camera.position_m, first->geometry(i)->camera.position_m);
    const std::size_t beside = first->size() + i;
    EXPECT_EQ(map->pose(beside).session, 1);
    EXPECT_EQ(map->pose(beside).stamp_ns, second->pose(i).stamp_ns);
    EXPECT_EQ(map->local(beside)->bytes(), second->local(i)->bytes());
    EXPECT_EQ(*map->vlad(i), map->header().vocabulary->describe(*first->local(i)));
    EXPECT_EQ(*map->vlad(beside), map->header().vocabulary->describe(*second->local(i)));
    EXPECT_NEAR((map->position_m(beside) - map->position_m(i)).norm(), 0.2, 0.15) << "driven 0.2 m beside";
    EXPECT_EQ(map->position_m(beside), map->geometry(beside)->camera.position_m.head<2>());
  }
  ASSERT_EQ(report_.size(), 2U);
  EXPECT_EQ(report_[0].tied, 0U);
  EXPECT_GT(report_[1].tied, 40U);
  EXPECT_NEAR(report_[1].apart_m, 1.8, 0.2);
  EXPECT_LT(report_[1].left_m, 0.05);
}

TEST_F(MapMerger, LandmarksMoveWithTheirImages) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0});
  const auto second = street_.mapOfDay(1, {1.5, -1.0});
  const auto map = merged({{"a.map", first}, {"b.map", second}});
  for (std::size_t i = 0; i < second->size(); ++i) {
    const auto before = second->geometry(i);
    const auto after = map->geometry(first->size() + i);
    ASSERT_EQ(before->landmarks.size(), after->landmarks.size());
    for (std::size_t k = 0; k < before->landmarks.size(); ++k) {
      const Eigen::Vector3d in_camera =
          before->camera.rotation.conjugate() * before->landmarks[k].offset_m.cast<double>();
      const Eigen::Vector3d moved = after->camera.rotation.conjugate() * after->landmarks[k].offset_m.cast<double>();
      EXPECT_TRUE(in_camera.isApprox(moved, 1e-5));
    }
  }
}

TEST_F(MapMerger, LandmarksOfTwoMapsHaveDifferentNumbers) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0});
  const auto map = merged({{"a.map", first}, {"b.map", street_.mapOfDay(1, {0.0, 0.0})}});
  std::map<std::uint32_t, std::set<int>> sessions;
  for (std::size_t i = 0; i < map->size(); ++i) {
    for (const SeenLandmark& landmark : map->geometry(i)->landmarks) sessions[landmark.id].insert(map->pose(i).session);
  }
  for (const auto& [id, of] : sessions) EXPECT_EQ(of.size(), 1U) << id;
}

TEST_F(MapMerger, TheResultDoesNotDependOnTheOrderOfTheMaps) {
  const NamedMap a{"a.map", street_.mapOfDay(0, {0.0, 0.0}, 0, 20)};
  const NamedMap b{"b.map", street_.mapOfDay(1, {0.7, 0.0}, 15, 35)};
  const NamedMap c{"c.map", street_.mapOfDay(2, {0.0, -0.7}, 30, 45)};
  const auto one = merged(inOrderOfTime({a, b, c}));
  for (const auto& maps : {std::vector{c, b, a}, std::vector{b, a, c}}) {
    const auto other = merged(inOrderOfTime(maps));
    ASSERT_EQ(one->size(), other->size());
    for (std::size_t i = 0; i < one->size(); ++i) {
      EXPECT_EQ(one->position_m(i), other->position_m(i));
      EXPECT_TRUE(test::same(one->image(i).geometry, other->image(i).geometry)) << i;
    }
  }
}

TEST_F(MapMerger, AnotherDatumKeepsWhereThingsAreOnTheEarth) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0}, 0, 10);
  const auto second = street_.mapOfDay(1, {0.0, 0.0}, 25, 45);
  MapHeader elsewhere = second->header();
  elsewhere.datum = {48.6, 9.2, 350.0};
  const auto map = merged({{"a.map", first}, {"b.map", changed(*second, elsewhere)}});
  const LocalFrame frame(elsewhere.datum);
  for (std::size_t i = 0; i < second->size(); ++i) {
    const GeodeticPoint before = frame.toGeodetic(second->position_m(i));
    const GeodeticPoint after = map->frame().toGeodetic(map->position_m(first->size() + i));
    EXPECT_NEAR(after.latitude_deg, before.latitude_deg, 1e-9);
    EXPECT_NEAR(after.longitude_deg, before.longitude_deg, 1e-9);
  }
}

TEST_F(MapMerger, MapsOfPlacesLieWhereTheirFixesHaveThem) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0});
  const auto second = street_.mapOfDay(1, {0.5, 0.5});
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < second->size(); ++i) {
    images.push_back(second->image(i));
    images.back().geometry.reset();
  }
  MapHeader header = second->header();
  header.sessions[0].camera.reset();
  const auto places = std::make_shared<const TrainingMap>(header, images);
  const auto map = merged({{"a.map", first}, {"b.map", places}});
  for (std::size_t i = 0; i < places->size(); ++i) {
    EXPECT_EQ(map->position_m(first->size() + i), places->position_m(i));
  }
  EXPECT_EQ(report_[1].with_landmarks, 0U);
}

TEST_F(MapMerger, SessionsOfOneNameGetNumbers) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0}, 0, 10);
  const auto second = changed(*street_.mapOfDay(1, {0.0, 0.0}, 0, 10), first->header());
  const auto map = merged({{"a.map", first}, {"b.map", second}});
  EXPECT_EQ(map->header().sessions[1].name, "day0_2");
}

TEST_F(MapMerger, RefusesMapsOfAnotherKind) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0}, 0, 10);
  const auto second = street_.mapOfDay(1, {0.0, 0.0}, 0, 10);
  MapHeader sift = second->header();
  SiftConfig weak = dynamic_cast<const Sift&>(*sift.kind).config();
  weak.contrast_threshold *= 0.5;
  sift.kind = std::make_shared<Sift>(weak);
  EXPECT_THAT(refusal({{"a.map", first}, {"b.map", changed(*second, sift)}}),
              AllOf(StartsWith("b.map: "), HasSubstr("contrast_threshold"), HasSubstr("a.map")));
  MapHeader far = second->header();
  far.datum.latitude_deg += 2.0;
  EXPECT_THAT(refusal({{"a.map", first}, {"b.map", changed(*second, far)}}),
              AllOf(StartsWith("b.map: is 222 km away from a.map"), HasSubstr("100 km")));
  MapHeader small;
  small.image_size = {320, 240};
  small.sessions = {{"small"}};
  const TrainingMap places(test::exampleHeader(), test::exampleImages(4));
  EXPECT_THAT(refusal({{"a.map", first}, {"b.map", changed(places, test::exampleHeader())}}),
              AllOf(StartsWith("b.map: "), HasSubstr("320x240 pixels"), HasSubstr("a.map of 640x480")));
}

TEST_F(MapMerger, RefusesASessionThatIsThereAlready) {
  const auto first = street_.mapOfDay(0, {0.0, 0.0});
  EXPECT_THAT(refusal({{"a.map", first}, {"b.map", street_.mapOfDay(0, {0.0, 0.0}, 10, 45)}}),
              AllOf(StartsWith("b.map: its session 'day0' is in a.map already"), HasSubstr("remove")));
}

}  // namespace
}  // namespace visual_localization
