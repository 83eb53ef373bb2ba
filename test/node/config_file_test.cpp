#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "node/node_config.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

std::string textOf(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Lists every parameter with its default, and is valid itself.
template <class Config>
void expectListsEveryParameter(const std::string& path) {
  Config config;
  const ParameterValues in_file = parameters::readYaml(path);
  const ParameterValues in_code = parameters::values([&config](ParameterVisitor& visitor) { config.declare(visitor); });
  ASSERT_EQ(in_file.size(), in_code.size());
  for (const auto& [name, value] : in_code) {
    ASSERT_EQ(in_file.count(name), 1U) << name << " is missing in the file";
    EXPECT_EQ(parameters::toString(in_file.at(name)), parameters::toString(value)) << name;
  }
  EXPECT_NO_THROW(assignParameters(config, in_file));
}

TEST(ConfigFile, LocalizerListsEveryParameterWithItsDefault) {
  expectListsEveryParameter<NodeParameters>(CONFIG_DIR "/localizer.yaml");
}

TEST(ConfigFile, MapBuilderListsEveryParameterWithItsDefault) {
  expectListsEveryParameter<MapBuilderConfig>(CONFIG_DIR "/map_builder.yaml");
}

TEST(ConfigFile, TheFilesAreGeneratedFromTheCode) {
  EXPECT_EQ(textOf(CONFIG_DIR "/localizer.yaml"), localizerYaml())
      << "generate it again: localizer_node --localizer-config > config/localizer.yaml";
  EXPECT_EQ(textOf(CONFIG_DIR "/map_builder.yaml"), mapBuilderYaml())
      << "generate it again: localizer_node --map-builder-config > config/map_builder.yaml";
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

TEST(ConfigFile, ThePageOfParametersIsGeneratedFromTheCode) {
  EXPECT_EQ(textOf(CONFIG_DIR "/../doc/parameters.md"), parametersPage())
      << "generate it again: localizer_node --parameters > doc/parameters.md";
}

}  // namespace
}  // namespace visual_localization
