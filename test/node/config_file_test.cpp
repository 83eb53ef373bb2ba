#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "node/node_config.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

/// The files are the lists of all parameters with their defaults that users read; this keeps them so.
template <class Config>
void expectListsEveryParameter(const std::string& path) {
  Config changed;
  const ParameterValues in_file = parameters::readYaml(path);
  const ParameterValues in_code =
      parameters::values([&changed](ParameterVisitor& visitor) { changed.declare(visitor); });
  for (const auto& [name, value] : in_code) {
    ASSERT_EQ(in_file.count(name), 1U) << name << " is missing in the file";
    EXPECT_EQ(parameters::toString(in_file.at(name)), parameters::toString(value)) << name;
  }
  for (const auto& entry : in_file) EXPECT_EQ(in_code.count(entry.first), 1U) << entry.first << " is no parameter";
  EXPECT_NO_THROW(assignParameters(changed, in_file));
}

TEST(ConfigFile, LocalizerListsEveryParameterWithItsDefault) {
  expectListsEveryParameter<NodeParameters>(CONFIG_DIR "/localizer.yaml");
}

TEST(ConfigFile, MapBuilderListsEveryParameterWithItsDefault) {
  expectListsEveryParameter<MapBuilderConfig>(CONFIG_DIR "/map_builder.yaml");
}

TEST(NodeConfig, MapCacheIsASizeInItsRange) {
  NodeParameters config;
  for (const ParameterValue& value : {ParameterValue(std::int64_t{-1}), ParameterValue(std::int64_t{1} << 40U),
                                      ParameterValue(1.5), ParameterValue(std::string("256 MB"))}) {
    EXPECT_THROW(assignParameters(config, {{"map_cache_mb", value}}), ParameterError);
  }
  assignParameters(config, {{"map_cache_mb", std::int64_t{1} << 20U}});
  EXPECT_EQ(config.node.mapLoading({}).cache_bytes, std::size_t{1} << 40U);
  assignParameters(config, {{"map_cache_mb", std::int64_t{0}}});
  EXPECT_EQ(config.node.mapLoading({}).cache_bytes, 0U);
}

TEST(ConfigFile, ThePageOfParametersIsWhatTheCodeSays) {
  std::ifstream file(CONFIG_DIR "/../doc/parameters.md");
  const std::string page((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_EQ(page, parametersPage()) << "make it anew: localizer_node --parameters > doc/parameters.md";
}

}  // namespace
}  // namespace visual_localization
