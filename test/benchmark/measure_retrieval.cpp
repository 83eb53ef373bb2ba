// How often the images of a map that look most alike show the place: recall by VLAD, by global features and by votes of
// the images of a second map, the drive. One line of CSV.

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "visual_localization/localization/scores.h"
#include "visual_localization/localization/similarity.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::benchmark {
namespace {

constexpr std::array<std::size_t, 3> kProposals{1, 5, 10};

/// In percent.
using Recall = std::array<double, kProposals.size()>;

using IsRight = std::function<bool(std::size_t drive, std::size_t map)>;
using Similarity = std::function<double(std::size_t drive, std::size_t map)>;

/// Of those images of the drive whose place is in the map.
Recall recallOf(std::size_t drive_images, std::size_t map_images, const IsRight& is_right,
                const Similarity& similarity) {
  Recall found{};
  double counted = 0.0;
  for (std::size_t i = 0; i < drive_images; ++i) {
    std::vector<std::pair<double, std::size_t>> order;
    bool in_map = false;
    for (std::size_t k = 0; k < map_images; ++k) {
      order.emplace_back(-similarity(i, k), k);
      in_map = in_map || is_right(i, k);
    }
    if (!in_map) continue;
    counted += 1.0;
    std::sort(order.begin(), order.end());
    const auto first =
        std::find_if(order.begin(), order.end(), [&](const auto& entry) { return is_right(i, entry.second); });
    for (std::size_t n = 0; n < kProposals.size(); ++n) {
      if (static_cast<std::size_t>(first - order.begin()) < kProposals[n]) found[n] += 100.0;
    }
  }
  for (double& share : found) share /= std::max(1.0, counted);
  return found;
}

void print(const char* name, const Recall& recall) {
  for (const double share : recall) std::printf(",%.0f", share);
  std::printf(" (%s)", name);
}

void measure(const std::string& map_path, const std::string& drive_path, double within_m, int within_places) {
  const auto map = loadMap(map_path);
  const auto drive = loadMap(drive_path);
  const auto vocabulary = map->header().vocabulary;
  if (!vocabulary) throw std::runtime_error(map_path + ": has no vocabulary");
  std::vector<Eigen::Vector2d> drive_m;
  std::vector<VladDescriptor> vlads;
  for (std::size_t i = 0; i < drive->size(); ++i) {
    drive_m.push_back(map->frame().toEastNorth(drive->frame().toGeodetic(drive->position_m(i))));
    vlads.push_back(vocabulary->describe(*drive->local(i)));
  }
  const auto is_right = [&](std::size_t i, std::size_t k) {
    const auto apart = static_cast<long>(i) - static_cast<long>(k);
    return within_places > 0 ? std::abs(apart) <= within_places : (drive_m[i] - map->position_m(k)).norm() <= within_m;
  };
  const GlobalSimilarity global{SimilarityConfig()};
  std::printf("%s,%s", map_path.c_str(), drive_path.c_str());
  print("vlad", recallOf(drive->size(), map->size(), is_right,
                         [&](std::size_t i, std::size_t k) { return vladSimilarity(vlads[i], *map->vlad(k)); }));
  print("global", recallOf(drive->size(), map->size(), is_right, [&](std::size_t i, std::size_t k) {
          return global.compare(*drive->global(i), *map->global(k)).similarity;
        }));
  const LocalSimilarity votes({MatchConfig().max_angle_ratio, "votes"}, SimilarityConfig(),
                              map->header().image_size.width, map->header().kind);
  print("votes", recallOf(drive->size(), map->size(), is_right, [&](std::size_t i, std::size_t k) {
          return votes.compare(*drive->local(i), *map->local(k)).similarity;
        }));
  std::printf("\n");
}

}  // namespace
}  // namespace visual_localization::benchmark

int main(int argc, char** argv) {
  CLI::App app("Recall at 1, 5 and 10 by VLAD, by global features and by votes.", "measure_retrieval");
  std::string map;
  std::string drive;
  double within_m = 5.0;
  int within_places = 0;
  app.add_option("map", map, "The map that is looked up")->required();
  app.add_option("drive", drive, "A map of the drive")->required();
  app.add_option("--within", within_m, "Metres from the true position that are right")->capture_default_str();
  app.add_option("--places", within_places, "Image i of the drive is right at images i - N to i + N instead");
  CLI11_PARSE(app, argc, argv);
  try {
    visual_localization::benchmark::measure(map, drive, within_m, within_places);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "measure_retrieval: %s\n", error.what());
    return 1;
  }
  return 0;
}
