// Localises images against a map: localize_image MAP IMAGE [IMAGE ...], images in the order in which they were taken.
#include <cstdint>
#include <exception>
#include <iostream>
#include <stdexcept>
#include <string>

#include <opencv2/imgcodecs.hpp>

#include "visual_localization/localization/localizer.h"
#include "visual_localization/map/map_file.h"

namespace vl = visual_localization;

namespace {

cv::Mat readGrey(const std::string& path) {
  cv::Mat grey = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (grey.empty()) throw std::runtime_error(path + ": cannot be read as an image");
  return grey;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: localize_image MAP IMAGE [IMAGE ...]\n";
    return 2;
  }
  try {
    const vl::LocalizerConfig config;                       // the defaults; doc/parameters.md explains each field
    vl::Localizer localizer(vl::loadMap(argv[1]), config);  // starts anywhere in the map
    for (int i = 2; i < argc; ++i) {
      const std::int64_t stamp_ns = std::int64_t{1'000'000'000} * (i - 2);  // one image a second
      const vl::Estimate estimate = localizer.process(stamp_ns, readGrey(argv[i]));
      std::cout << argv[i] << ": " << toString(estimate.state) << ", east " << estimate.pose.position_m.x()
                << " m, north " << estimate.pose.position_m.y() << " m, yaw " << estimate.pose.yaw_rad
                << " rad: " << describe(estimate.why) << "\n";
    }
  } catch (const std::exception& error) {
    std::cerr << "localize_image: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
