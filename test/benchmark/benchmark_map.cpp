// Opens a map of make_street_map and drives through it: one line of CSV with times and memory. One process a map,
// because memory that was used once is not given back.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <unistd.h>

#include "base/time.h"
#include "test/benchmark/street_map.h"
#include "test/support/fake_image.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::benchmark {
namespace {

struct Options {
  std::string map;
  std::size_t cache_mb = kDefaultMapCache_mb;
  std::size_t steps = 200;
  std::size_t features = 100;
  std::uint64_t seed = 1;
  double max_range_m = LocalizerConfig().dpso.max_range_m;
  int sweep_images = LocalizerConfig().sweep_images;
  std::string tracker = LocalizerConfig().tracker;
  bool header = false;
};

double resident_mib() {
  std::ifstream status("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  status >> total >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

void forget(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY);
  ::fdatasync(file);
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

/// Views that are compared with the map like a camera's images, but were never extracted.
class StreetImage final : public test::FakeImage {
 public:
  StreetImage(const StreetMap& streets, const TrainingMap& map) : streets_(streets), map_(map) {}

  void show(std::size_t at) {
    sift_ = streets_.view(at, 1);
    global_ = streets_.global(at);
    vlad_.reset();
  }
  Score compare(FeatureKind kind, std::size_t i) override {
    if (kind == FeatureKind::kVlad) {
      if (!vlad_) vlad_ = map_.header().vocabulary->describe(sift_);
      const double similarity = vladSimilarity(*vlad_, *map_.vlad(i));
      return {similarity, similarity};
    }
    return kind == FeatureKind::kLocal ? by_sift_.compare(sift_, *map_.local(i))
                                       : by_global_.compare(global_, *map_.global(i));
  }
  std::size_t localFeatures() override { return sift_.size(); }

 private:
  const StreetMap& streets_;
  const TrainingMap& map_;
  LocalFeatures sift_;
  GlobalFeatures global_;
  std::optional<VladDescriptor> vlad_;
  LocalSimilarity by_sift_{MatchConfig(), SimilarityConfig()};
  GlobalSimilarity by_global_{SimilarityConfig()};
};

struct Drive {
  std::vector<double> steps_ms;
  double comparisons = 0.0;
  double tracking = 0.0;  ///< share of the images
  std::size_t first = 0;  ///< images until the first TRACKING, this one included; 0: never

  double quantile_ms(double share) {
    std::sort(steps_ms.begin(), steps_ms.end());
    return steps_ms[static_cast<std::size_t>(share * static_cast<double>(steps_ms.size() - 1))];
  }
};

/// Along the images from `begin` on, one a step; places beyond the map look like nothing in it.
Drive drive(StreetImage& image, Localizer& localizer, std::size_t begin, std::size_t steps) {
  Drive result;
  for (std::size_t i = begin; i < begin + steps; ++i) {
    image.show(i);
    const Stopwatch stopwatch;
    const Estimate estimate = localizer.process(static_cast<std::int64_t>(i) * 1'000'000'000, {});
    result.steps_ms.push_back(stopwatch.elapsed_ms());
    result.comparisons += static_cast<double>(estimate.comparisons) / static_cast<double>(steps);
    const bool tracking = estimate.state == LocalizationState::kTracking;
    result.tracking += (tracking ? 1.0 : 0.0) / static_cast<double>(steps);
    if (tracking && result.first == 0) result.first = i - begin + 1;
  }
  return result;
}

LocalizerConfig configOf(const Options& options) {
  LocalizerConfig config;
  config.sweep_images = options.sweep_images;
  config.tracker = options.tracker;
  config.dpso.max_range_m = options.max_range_m;
  return config;
}

Drive driveTracked(const StreetMap& streets, const std::shared_ptr<const TrainingMap>& map, const Options& options) {
  const std::size_t begin = map->size() / 2;
  const auto image = std::make_shared<StreetImage>(streets, *map);
  Localizer localizer(map, configOf(options), image);
  localizer.relocalize(around(map->position_m(begin), 5.0));
  return drive(*image, localizer, begin, std::min(options.steps, map->size() - begin));
}

double open_s(const Options& options, std::shared_ptr<const TrainingMap>& map) {
  map.reset();
  const Stopwatch stopwatch;
  map = loadMap(options.map, {options.cache_mb << 20U, {}});
  return 1e-3 * stopwatch.elapsed_ms();
}

void measure(const Options& options) {
  const double before_mib = resident_mib();
  std::shared_ptr<const TrainingMap> map;
  forget(options.map);
  const double cold_open_s = open_s(options, map);
  const double opened_mib = resident_mib() - before_mib;
  const StreetMap streets(map->size(), options.features, options.seed);
  Drive cold = driveTracked(streets, map, options);
  const double driven_mib = resident_mib() - before_mib;
  const double open_again_s = open_s(options, map);
  Drive from_file = driveTracked(streets, map, options);
  Drive warm = driveTracked(streets, map, options);

  const auto image = std::make_shared<StreetImage>(streets, *map);
  Localizer lost_robot(map, configOf(options), image);
  Drive lost = drive(*image, lost_robot, 2 * map->size(), 30);
  const double lost_mib = resident_mib() - before_mib;
  Localizer searching_robot(map, configOf(options), image);
  Drive searching = drive(*image, searching_robot, map->size() / 4, std::min<std::size_t>(400, map->size() / 2));

  if (options.header) {
    std::printf(
        "images,file_mib,open_cold_s,open_s,rss_opened_mib,rss_driven_mib,rss_lost_mib,cold_median_ms,cold_95_ms,"
        "file_median_ms,file_95_ms,warm_median_ms,warm_95_ms,comparisons,tracking,lost_median_ms,lost_95_ms,"
        "unknown_start_images,unknown_start_median_ms,unknown_start_95_ms\n");
  }
  std::printf("%zu,%.1f,%.3f,%.3f,%.0f,%.0f,%.0f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.1f,%.2f,%.3f,%.3f,%zu,%.3f,%.3f\n",
              map->size(), static_cast<double>(std::filesystem::file_size(options.map)) / (1 << 20), cold_open_s,
              open_again_s, opened_mib, driven_mib, lost_mib, cold.quantile_ms(0.5), cold.quantile_ms(0.95),
              from_file.quantile_ms(0.5), from_file.quantile_ms(0.95), warm.quantile_ms(0.5), warm.quantile_ms(0.95),
              warm.comparisons, warm.tracking, lost.quantile_ms(0.5), lost.quantile_ms(0.95), searching.first,
              searching.quantile_ms(0.5), searching.quantile_ms(0.95));
}

}  // namespace
}  // namespace visual_localization::benchmark

int main(int argc, char** argv) {
  using namespace visual_localization::benchmark;
  CLI::App app("Measures how a map of make_street_map opens and how fast it is driven through.", "benchmark_map");
  Options options;
  app.add_option("--map", options.map, "Map file")->required();
  app.add_option("--cache-mb", options.cache_mb, "As map_cache_mb of the localizer")->capture_default_str();
  app.add_option("--steps", options.steps, "Images to drive")->capture_default_str();
  app.add_option("--features", options.features, "Of an image, as the map was made with")->capture_default_str();
  app.add_option("--seed", options.seed, "As the map was made with")->capture_default_str();
  app.add_option("--max-range", options.max_range_m, "As dpso/max_range, metres")->capture_default_str();
  app.add_option("--sweep-images", options.sweep_images, "As the parameter of the localizer")->capture_default_str();
  app.add_option("--tracker", options.tracker, "As the parameter of the localizer")->capture_default_str();
  app.add_flag("--header", options.header, "Print the names of the columns");
  CLI11_PARSE(app, argc, argv);
  try {
    measure(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "benchmark_map: %s\n", error.what());
    return 1;
  }
  return 0;
}
