// Writes a synthetic map of any size: a grid of streets (see street_map.h).

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "map/map_writer.h"
#include "test/benchmark/street_map.h"

int main(int argc, char** argv) {
  using namespace visual_localization;
  CLI::App app("Writes a synthetic map: a grid of streets with an image every metre.", "make_street_map");
  std::size_t images = 400;
  std::size_t features = 100;
  std::uint64_t seed = 1;
  std::string output;
  app.add_option("--images", images, "Number of images")->check(CLI::Range(1, 100'000'000))->capture_default_str();
  app.add_option("--features", features, "SIFT features an image")->check(CLI::Range(1, 10'000))->capture_default_str();
  app.add_option("--seed", seed, "Another seed, another city")->capture_default_str();
  app.add_option("--output", output, "The map file to write")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto start = std::chrono::steady_clock::now();
    const benchmark::StreetMap streets(images, features, seed);
    MapWriter writer(output);
    for (std::size_t i = 0; i < images; ++i) writer.append(streets.image(i));
    writer.finish(benchmark::StreetMap::header());
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%zu images in %.1f s: %.0f images/s\n", images, seconds, static_cast<double>(images) / seconds);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_street_map: %s\n", error.what());
    return 1;
  }
  return 0;
}
