// Writes a synthetic map of any size, or one part of it: a grid of streets (see street_map.h).

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "map/map_writer.h"
#include "test/benchmark/street_map.h"

namespace {

constexpr std::size_t kOverlap = 100;  ///< images that a part shares with the next one

}  // namespace

int main(int argc, char** argv) {
  using namespace visual_localization;
  CLI::App app("Writes a synthetic map: a grid of streets with an image every metre.", "make_street_map");
  std::size_t images = 400;
  std::size_t features = 100;
  std::uint64_t seed = 1;
  std::size_t parts = 1;
  std::size_t part = 0;
  bool landmarks = false;
  std::string output;
  app.add_option("--images", images, "Number of images")->check(CLI::Range(1, 100'000'000))->capture_default_str();
  app.add_option("--features", features, "SIFT features an image")->check(CLI::Range(1, 10'000))->capture_default_str();
  app.add_option("--seed", seed, "Another seed, another city")->capture_default_str();
  app.add_flag("--landmarks", landmarks,
               "Features are landmarks, and the session has a camera and an error of its own");
  app.add_option("--parts", parts, "Write one of so many parts of the city")->check(CLI::Range(1, 100'000));
  app.add_option("--part", part, "Which one, from 0; each shows 100 images of the next one as well");
  app.add_option("--output", output, "The map file to write")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto start = std::chrono::steady_clock::now();
    const benchmark::StreetMap streets(images, features, seed, landmarks);
    const std::size_t begin = images * part / parts;
    const std::size_t end = part + 1 >= parts ? images : std::min(images, images * (part + 1) / parts + kOverlap);
    MapHeader header = landmarks ? benchmark::StreetMap::locatedHeader("streets_" + std::to_string(part))
                                 : benchmark::StreetMap::header();
    const auto view = [&](std::size_t i) { return std::make_shared<LocalFeatures>(streets.view(begin + i, 0)); };
    header.vocabulary = VladVocabulary::learn(end - begin, view, header.image_size);
    MapWriter writer(output);
    for (std::size_t i = begin; i < end; ++i) {
      TrainingImage image = landmarks ? streets.locatedImage(i, part + 1) : streets.image(i);
      if (header.vocabulary) image.vlad = header.vocabulary->describe(image.local);
      writer.append(image);
    }
    writer.finish(header);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto written = static_cast<double>(end - begin);
    std::printf("%.0f images in %.1f s: %.0f images/s\n", written, seconds, written / seconds);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_street_map: %s\n", error.what());
    return 1;
  }
  return 0;
}
