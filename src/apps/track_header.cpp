#include "apps/track_header.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/commit.h"
#include "base/files.h"
#include "base/text.h"
#include "map/map_schema.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization::apps {
namespace {

std::string fileCrc32(const std::string& path) {
  constexpr std::size_t kBlock_bytes = std::size_t{1} << 20U;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw FileError(path + ": cannot be read");
  std::vector<char> block(kBlock_bytes);
  std::int64_t crc = 0;
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())) || file.gcount() > 0) {
    const auto* data = reinterpret_cast<const std::uint8_t*>(block.data());
    crc = map_schema::crc32Of({data, static_cast<std::size_t>(file.gcount())}, crc);
  }
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%08lx", static_cast<unsigned long>(crc));
  return text.data();
}

/// A text of JSON is one of YAML.
std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string trackHeader(const LocalizeOptions& options, const LocalizerConfig& config, const Localizer& localizer) {
  std::ostringstream out = numberStream();
  const auto add = [&out](const char* key, const std::string& text) { out << key << ": " << quoted(text) << '\n'; };
  add("version", VISUAL_LOCALIZATION_VERSION);
  add("commit", kCommit);
  add("map", options.map);
  add("map_crc32", fileCrc32(options.map));
  add("bag", options.bag);
  add("image_topic", options.image_topic);
  add("truth_topic", options.truth_topic);
  add("odom_topic", options.odom_topic);
  add("camera", localizer.camera() ? describe(*localizer.camera()) : "");
  const CameraPose& camera = localizer.mount().camera;
  out << "camera_position_m: [" << camera.position_m.x() << ", " << camera.position_m.y() << ", "
      << camera.position_m.z() << "]\n";
  out << "start_index: " << options.start_index << '\n';
  if (options.kidnap_at) out << "kidnap: [" << *options.kidnap_at << ", " << *options.kidnap_to << "]\n";
  out << "seed: " << config.seed << "\nparameters:\n";
  for (const auto& [name, value] : visual_localization::valuesOf(config)) {
    out << "  " << name << ": " << quoted(parameters::toString(value)) << '\n';
  }
  return out.str();
}

}  // namespace visual_localization::apps
