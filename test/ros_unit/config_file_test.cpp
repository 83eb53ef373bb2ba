#include <string>

#include <gtest/gtest.h>

#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/node_config.h"

namespace visual_localization {
namespace {

/// config/localizer.yaml is the list of all parameters with their defaults that users read; this keeps it one.
TEST(ConfigFile, ListsEveryParameterWithItsDefault) {
  NodeParameters changed;
  const ParameterValues in_file = parameters::readYaml(LOCALIZER_YAML);
  const ParameterValues in_code =
      parameters::values([&changed](ParameterVisitor& visitor) { changed.declare(visitor); });
  for (const auto& [name, value] : in_code) {
    ASSERT_EQ(in_file.count(name), 1U) << name << " is missing in the file";
    EXPECT_EQ(parameters::toString(in_file.at(name)), parameters::toString(value)) << name;
  }
  for (const auto& entry : in_file) EXPECT_EQ(in_code.count(entry.first), 1U) << entry.first << " is no parameter";
  EXPECT_NO_THROW(assignParameters(changed, in_file));
}

}  // namespace
}  // namespace visual_localization
