#include "visual_localization/map/map_builder.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/app_support.h"
#include "apps/progress_bar.h"
#include "apps/trajectory_plot.h"
#include "base/files.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

struct Options {
  std::vector<std::string> bags;
  std::string image_topic = "/stereo/left/image_raw";
  std::string fix_topic = "/gps/fix";
  std::string output;
  std::string config;
  std::string plot;
  std::optional<double> min_spacing_m;
  std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
  std::optional<std::string> sift_backend;
};

void declareOptions(CLI::App& app, Options& options) {
  app.add_option("--bag", options.bags, "a recorded round; repeat it for more rounds in one map")
      ->required()
      ->take_all()
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--image-topic", options.image_topic, "raw or compressed images; \"/compressed\" is found by itself")
      ->capture_default_str();
  app.add_option("--fix-topic", options.fix_topic, "sensor_msgs/NavSatFix")->capture_default_str();
  app.add_option("--output", options.output, "the map file to write")->required();
  app.add_option("--config", options.config, "YAML file of parameters");
  app.add_option("--min-spacing", options.min_spacing_m, "metres between kept images; overrides the configuration");
  app.add_option("--threads", options.threads, "for extraction; the map does not depend on it")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1024}))
      ->capture_default_str();
  app.add_option("--sift-backend", options.sift_backend, "native or opencv; overrides the configuration");
  app.add_option("--plot", options.plot, "draw fixes and cleaned path into this SVG file");
}

void overrideWith(MapBuilderConfig& config, const char* option, const char* parameter, const ParameterValue& value) {
  try {
    assignParameters(config, {{parameter, value}});
  } catch (const ParameterError& error) {
    throw apps::UsageError(std::string(option) + ": " + error.what());
  }
}

MapBuilderConfig readConfig(const Options& options) {
  MapBuilderConfig config;
  if (!options.config.empty()) {
    const ParameterValues values = parameters::readYaml(options.config);
    try {
      assignParameters(config, values);
    } catch (const ParameterError& error) {
      throw ParameterError(options.config + ": " + error.what());
    }
  }
  if (options.min_spacing_m) overrideWith(config, "--min-spacing", "map/min_spacing", *options.min_spacing_m);
  if (options.sift_backend) overrideWith(config, "--sift-backend", "map/sift_backend", *options.sift_backend);
  return config;
}

/// Bags of the same name in different folders get different session names.
std::string sessionName(const std::string& bag, const std::vector<apps::PlottedRound>& rounds) {
  const std::string stem = std::filesystem::path(bag).stem().string();
  std::string name = stem;
  for (std::size_t n = 2;; ++n) {
    bool taken = false;
    for (const apps::PlottedRound& round : rounds) taken = taken || round.name == name;
    if (!taken) return name;
    name = stem + "_" + std::to_string(n);
  }
}

/// The map would be twice as large and show nothing more, while every place seemed to be seen by two sessions.
void requireDifferent(const std::vector<std::string>& bags) {
  for (std::size_t i = 0; i < bags.size(); ++i) {
    for (std::size_t earlier = 0; earlier < i; ++earlier) {
      std::error_code none;
      if (std::filesystem::equivalent(bags[i], bags[earlier], none)) {
        throw apps::UsageError("--bag " + bags[i] + " is the same file as --bag " + bags[earlier]);
      }
    }
  }
}

/// An image that cannot be decoded is worth one line the first time, and is counted.
cv::Mat decode(const BagImage& image, const std::string& where, bool& warned) {
  try {
    return image.decode();
  } catch (const ImageError& error) {
    if (!warned) std::cerr << where << ": unusable image: " << error.what() << std::endl;
    warned = true;
    return {};
  }
}

void addImages(MapBuilder& builder, const BagReader& bag, const std::string& topic) {
  const BagImages images = bag.images(topic);
  apps::ProgressBar bar("extracting features");
  bool warned = false;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const BagImage image = images.read(i);
    if (builder.wants(image.stamp_ns)) {
      builder.addImage(image.stamp_ns, decode(image, bag.path() + ": " + images.topic(), warned));
    }
    bar.show(i + 1, images.size());
  }
}

void addRound(MapBuilder& builder, const std::string& path, const Options& options,
              std::vector<apps::PlottedRound>& rounds) {
  const BagReader bag(path);
  apps::PlottedRound round{sessionName(path, rounds), bag.fixes(options.fix_topic), {}, {}};
  try {
    builder.beginSession(round.name, round.fixes);
  } catch (const std::exception& error) {
    throw BagError(path + ": " + options.fix_topic + ": " + error.what());
  }
  round.cleaned = builder.report().sessions.back();
  rounds.push_back(std::move(round));
  addImages(builder, bag, options.image_topic);
}

void printFixes(const apps::PlottedRound& round) {
  constexpr std::array<FixVerdict, 5> verdicts{FixVerdict::kKept, FixVerdict::kNoFix, FixVerdict::kDisordered,
                                               FixVerdict::kSpike, FixVerdict::kMultipath};
  std::cout << round.name << ": " << round.fixes.size() << " fixes:";
  for (const FixVerdict verdict : verdicts) {
    const auto count = std::count(round.cleaned.verdicts.begin(), round.cleaned.verdicts.end(), verdict);
    std::cout << (verdict == FixVerdict::kKept ? " " : ", ") << count << ' ' << toString(verdict);
  }
  std::cout << "; " << round.cleaned.gaps_closed << " gaps closed, the longest " << round.cleaned.longest_gap_s
            << " s; path " << round.cleaned.trajectory.length() << " m\n";
}

/// What one round brought, and whether its images had to be bent into shape.
void printImages(const SessionImages& session, cv::Size in_map) {
  std::cout << session.name << ": " << session.kept << " images";
  if (session.kept != 0) std::cout << " of " << session.recorded.width << 'x' << session.recorded.height << " px";
  if (session.kept != 0 && session.recorded != in_map) {
    std::cout << ", resized to " << in_map.width << 'x' << in_map.height;
    const double stretch = stretchOf(session.recorded, in_map);
    constexpr double kHarmless = 0.02;
    if (std::abs(stretch - 1.0) > kHarmless) {
      std::cout << "; that distorts them (width by " << std::setprecision(2) << stretch << std::setprecision(1)
                << "): only the same camera will recognise them";
    }
  }
  std::cout << '\n';
}

/// The size of the map's images is that of the first.
void printSessionImages(const std::vector<SessionImages>& sessions) {
  const auto first = std::find_if(sessions.begin(), sessions.end(), [](const auto& session) { return session.kept; });
  for (const SessionImages& session : sessions) printImages(session, first->recorded);
}

void printReport(const MapBuildReport& report, const std::vector<apps::PlottedRound>& rounds) {
  std::cout << std::fixed << std::setprecision(1);
  for (const apps::PlottedRound& round : rounds) printFixes(round);
  if (rounds.size() > 1) printSessionImages(report.session_images);
  std::cout << "images: " << report.images_kept << " kept, " << report.images_without_position << " without position, "
            << report.images_too_close << " too close, " << report.images_disordered << " disordered, "
            << report.images_unusable << " unusable\n";
  const double dropped = report.features_extracted == 0 ? 0.0
                                                        : 100.0 - 100.0 * static_cast<double>(report.features_kept) /
                                                                      static_cast<double>(report.features_extracted);
  std::cout << "features: " << report.features_extracted << " extracted, " << report.features_kept
            << " kept after pruning (" << dropped << " % dropped)\n";
}

std::size_t fixesKept(const MapBuildReport& report) {
  std::size_t kept = 0;
  for (const CleanedTrajectory& session : report.sessions) {
    kept += static_cast<std::size_t>(std::count(session.verdicts.begin(), session.verdicts.end(), FixVerdict::kKept));
  }
  return kept;
}

void printSummary(const Options& options, const MapBuildReport& report, double seconds) {
  std::size_t fixes = 0;
  std::size_t gaps = 0;
  for (const CleanedTrajectory& session : report.sessions) {
    fixes += session.verdicts.size();
    gaps += session.gaps_closed;
  }
  std::cout << options.output << ": " << report.images_kept << " images, " << fixesKept(report) << " of " << fixes
            << " fixes, " << gaps << " gaps closed, features " << report.features_extracted << " -> "
            << report.features_kept << ", "
            << apps::humanSize(static_cast<double>(std::filesystem::file_size(options.output))) << ", " << seconds
            << " s\n";
}

/// Throws FileError when `path` cannot be created or replaced.
void requireWritable(const std::string& path) { const PartialFile attempt(path); }

void buildMap(const Options& options) {
  const auto start = std::chrono::steady_clock::now();
  // Fails before the work when the results could not be written after it.
  const MapBuilderConfig config = readConfig(options);
  std::vector<std::string> inputs = options.bags;
  inputs.push_back(options.config);
  requireDifferent(options.bags);
  apps::requireNoInput("--output", options.output, inputs);
  inputs.push_back(options.output);
  if (!options.plot.empty()) apps::requireNoInput("--plot", options.plot, inputs);
  requireWritable(options.output);
  if (!options.plot.empty()) requireWritable(options.plot);
  MapBuilder builder(config, {options.threads, options.output});
  std::vector<apps::PlottedRound> rounds;
  for (const std::string& bag : options.bags) addRound(builder, bag, options, rounds);
  {
    apps::ProgressBar bar("pruning features");
    builder.save(options.output, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  for (std::size_t r = 0; r < rounds.size(); ++r) {
    rounds[r].images_m = builder.report().session_images[r].positions_m;
  }
  if (!options.plot.empty()) writeFile(options.plot, apps::plotTrajectories(rounds, builder.frame()));
  printReport(builder.report(), rounds);
  printSummary(options, builder.report(),
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace
}  // namespace visual_localization

int main(int argc, char** argv) {
  CLI::App app("Builds a map from recorded rounds: images and DGPS fixes in, training images with positions out.",
               "map_builder");
  visual_localization::Options options;
  visual_localization::declareOptions(app, options);
  return visual_localization::apps::runProgram(app, argc, argv, [&options] { visual_localization::buildMap(options); });
}
