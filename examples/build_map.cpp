// Builds a map from images and positions: build_map LIST MAP. Each line of LIST is `seconds latitude longitude image`.
#include <cmath>
#include <cstdint>
#include <exception>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "visual_localization/map/map_builder.h"

namespace vl = visual_localization;

namespace {

/// The fixes of all lines, and the images beside them.
struct Recording {
  std::vector<vl::Fix> fixes;
  std::vector<std::string> images;
};

Recording readList(const std::string& path) {
  Recording recording;
  std::ifstream list(path);
  double seconds = 0.0;
  vl::GeodeticPoint position;
  std::string image;
  while (list >> seconds >> position.latitude_deg >> position.longitude_deg >> image) {
    recording.fixes.push_back({std::llround(1e9 * seconds), position, true});
    recording.images.push_back(image);
  }
  return recording;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: build_map LIST MAP\n";
    return 2;
  }
  try {
    const Recording recording = readList(argv[1]);
    vl::MapBuilder builder{vl::MapBuilderConfig()};
    builder.beginSession("example", recording.fixes);  // cleans the fixes into a path
    for (std::size_t i = 0; i < recording.images.size(); ++i) {
      const std::int64_t stamp_ns = recording.fixes[i].stamp_ns;
      if (builder.wants(stamp_ns)) builder.addImage(stamp_ns, cv::imread(recording.images[i], cv::IMREAD_GRAYSCALE));
    }
    builder.save(argv[2]);
    std::cout << argv[2] << ": " << builder.report().images_kept << " images\n";
  } catch (const std::exception& error) {
    std::cerr << "build_map: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
