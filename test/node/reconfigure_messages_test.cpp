#include <algorithm>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "node/node_config.h"
#include "node/reconfigure_server.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

class ReconfigureMessages : public ::testing::Test {
 protected:
  dynamic_reconfigure::ConfigDescription description() { return toDescription(declare_); }

  NodeParameters parameters_;
  parameters::Declaration declare_ = [this](ParameterVisitor& visitor) { parameters_.declare(visitor); };
};

std::set<std::string> namesOf(const dynamic_reconfigure::ConfigDescription& description) {
  std::set<std::string> names;
  for (const auto& group : description.groups) {
    for (const auto& parameter : group.parameters) EXPECT_TRUE(names.insert(parameter.name).second) << parameter.name;
  }
  return names;
}

template <class Parameters>
auto valueOf(const Parameters& parameters, const std::string& name) {
  const auto found = std::find_if(parameters.begin(), parameters.end(),
                                  [&name](const auto& parameter) { return parameter.name == name; });
  if (found == parameters.end()) throw std::runtime_error(name + " is missing");
  return found->value;
}

TEST_F(ReconfigureMessages, EverythingThatCanChangeIsDescribedAndNothingElse) {
  const std::set<std::string> at_start{"map",
                                       "map_directory",
                                       "map_cache_mb",
                                       "image_transport",
                                       "tf_mode",
                                       "global_frame_id",
                                       "odom_frame_id",
                                       "base_frame_id",
                                       "camera_info_file",
                                       "mask_file",
                                       "camera_mount",
                                       "seed",
                                       "tf_metric_only",
                                       "use_odometry",
                                       "tf_rate",
                                       "usage_file",
                                       "session_folder",
                                       "model",
                                       "preset"};
  std::set<std::string> expected;
  for (const auto& entry : parameters::values(declare_)) {
    if (at_start.count(entry.first) == 0) expected.insert(entry.first);
  }
  EXPECT_EQ(namesOf(description()), expected);
  EXPECT_GT(expected.size(), 50U);
}

TEST_F(ReconfigureMessages, RangesAndDefaultsAreThoseOfTheDeclarations) {
  const auto message = description();
  EXPECT_EQ(valueOf(message.min.ints, "dpso/particles"), 2);
  EXPECT_EQ(valueOf(message.max.ints, "dpso/particles"), 100000);
  EXPECT_EQ(valueOf(message.dflt.ints, "dpso/particles"), 80);
  EXPECT_EQ(valueOf(message.max.doubles, "fitness/distance_sigma"), 1000.0);
  EXPECT_EQ(valueOf(message.dflt.strs, "tracker"), "bayes");
  EXPECT_EQ(valueOf(message.dflt.bools, "prune"), 0);
}

TEST_F(ReconfigureMessages, GroupsAreWhatStandsBeforeTheSlashAndHaveNoNameThatToolsUseThemselves) {
  const auto message = description();
  ASSERT_EQ(message.groups.front().name, "Default");
  ASSERT_EQ(message.groups.front().id, 0);
  const std::set<std::string> reserved{"id", "parent", "name", "type", "state", "groups", "parameters"};
  std::set<int> ids;
  for (const auto& group : message.groups) {
    EXPECT_TRUE(ids.insert(group.id).second);
    EXPECT_EQ(reserved.count(group.name), 0U) << group.name;
    for (const auto& parameter : group.parameters) {
      EXPECT_EQ(reserved.count(parameter.name), 0U) << parameter.name;
      if (group.id != 0) {
        EXPECT_EQ(parameter.name.rfind(group.name, 0), 0U) << parameter.name;
      }
    }
  }
  EXPECT_EQ(toConfig(declare_).groups.size(), message.groups.size());
}

TEST_F(ReconfigureMessages, ValuesComeBackAsTheyWent) {
  parameters_.localizer.tracker = "pf_linear";
  parameters_.localizer.dpso.phi2 = 0.1 + 0.2;
  const ParameterValues values = toValues(toConfig(declare_), declare_);
  NodeParameters other;
  assignParameters(other, values);
  EXPECT_EQ(other.localizer.tracker, "pf_linear");
  EXPECT_EQ(other.localizer.dpso.phi2, 0.1 + 0.2);
}

TEST_F(ReconfigureMessages, WhatIsReadAtTheStartCannotBeSet) {
  dynamic_reconfigure::Config config;
  config.strs.resize(1);
  config.strs[0].name = "map";
  config.strs[0].value = "other.map";
  EXPECT_THAT(test::refusalOf<ParameterError>([&] { toValues(config, declare_); }),
              testing::HasSubstr("'map' = other.map"));
}

}  // namespace
}  // namespace visual_localization
