#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "node/node_config.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using XmlRpc::XmlRpcValue;

/// Empty without one.
std::string errorOf(const ParameterValues& values) {
  NodeParameters parameters;
  try {
    assignParameters(parameters, values);
  } catch (const ParameterError& error) {
    return error.what();
  }
  return {};
}

TEST(ParameterServer, NestedNamesAreJoined) {
  XmlRpcValue tree;
  tree["map"] = "campus.map";
  tree["seed"] = 7;
  tree["prune"] = XmlRpcValue(false);
  tree["dpso"]["inertia"] = 0.9;
  const ParameterValues values = flatten(tree);
  EXPECT_EQ(values.at("map"), ParameterValue(std::string("campus.map")));
  EXPECT_EQ(values.at("seed"), ParameterValue(std::int64_t{7}));
  EXPECT_EQ(values.at("prune"), ParameterValue(false));
  EXPECT_EQ(values.at("dpso/inertia"), ParameterValue(0.9));
}

TEST(ParameterServer, AnEmptyNamespaceHasNoValues) { EXPECT_TRUE(flatten(XmlRpcValue()).empty()); }

TEST(ParameterServer, AListIsRefusedByName) {
  XmlRpcValue tree;
  tree["dpso"]["inertia"][0] = 0.9;
  EXPECT_THAT(test::refusalOf<ParameterError>([&] { flatten(tree); }), testing::HasSubstr("'dpso/inertia'"));
}

TEST(ParameterServer, ParametersOfOthersAreKnown) {
  EXPECT_TRUE(belongsToOthers("diagnostic_period"));
  EXPECT_TRUE(belongsToOthers("matches/compressed/jpeg_quality"));
  EXPECT_TRUE(belongsToOthers("dashboard/compressed/format"));
  EXPECT_TRUE(belongsToOthers("compressed/mode"));
  EXPECT_FALSE(belongsToOthers("image_transport"));
  EXPECT_FALSE(belongsToOthers("dpso/inertia"));
}

TEST(NodeParameters, DefaultsAreValid) { EXPECT_TRUE(violationsOf(NodeParameters()).empty()); }

TEST(NodeParameters, ErrorsNameParameterValueAndRange) {
  const std::string range = errorOf({{"transform_tolerance", -1.0}});
  EXPECT_NE(range.find("'transform_tolerance'"), std::string::npos);
  EXPECT_NE(range.find("-1"), std::string::npos);
  EXPECT_NE(range.find("[0, 60]"), std::string::npos);
  EXPECT_NE(errorOf({{"tf_mode", std::string("odom")}}).find("map_to_odom"), std::string::npos);
  EXPECT_NE(errorOf({{"partikles", std::int64_t{3}}}).find("'partikles'"), std::string::npos);
}

TEST(NodeParameters, FramesNeedANameThatTfUnderstands) {
  EXPECT_NE(errorOf({{"odom_frame_id", std::string("/odom")}}).find("'odom_frame_id'"), std::string::npos);
  EXPECT_NE(errorOf({{"base_frame_id", std::string()}}).find("'base_frame_id'"), std::string::npos);
  EXPECT_NE(errorOf({{"global_frame_id", std::string("odom")}}).find("'global_frame_id'"), std::string::npos);
}

TEST(NodeParameters, AnIntegerServesAsANumber) { EXPECT_EQ(errorOf({{"transform_tolerance", std::int64_t{1}}}), ""); }

}  // namespace
}  // namespace visual_localization
