/// Requests of services and of rviz, as anyone on the network may send them. The first byte chooses.
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "node/message_conversions.h"
#include "node/node_config.h"
#include "node/shared_localizer.h"
#include "test/fuzz/fuzz_support.h"
#include "test/support/example_map.h"

namespace visual_localization {
namespace {

std::shared_ptr<const TrainingMap> exampleMap() {
  static const auto map = std::make_shared<const TrainingMap>(test::exampleHeader(), test::exampleImages(12));
  return map;
}

SharedLocalizer& localizer() {
  static SharedLocalizer shared{LocalizerConfig()};
  if (!shared.hasMap()) shared.setMap(exampleMap());
  return shared;
}

/// What is valid starts a search, which takes far longer than to read it: one in 16 does.
bool isSearched(const std::string& bytes) { return !bytes.empty() && bytes.back() % 16 == 0; }

void relocalize(fuzz::Input input) {
  const bool searched = isSearched(input.rest());
  const auto east_m = input.number<double>();
  const auto north_m = input.number<double>();
  const Eigen::Vector2d centre_m(east_m, north_m);
  const auto radius_m = input.number<double>();
  fuzz::expect<std::invalid_argument>([&] {
    around(centre_m, radius_m);
    if (searched) localizer().relocalizeAround(centre_m, radius_m);
    fuzz::countRead();
  });
}

void guessPose(fuzz::Input input) {
  const bool searched = isSearched(input.rest());
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header.frame_id = input.number<std::uint8_t>() < 200 ? "map" : input.text();
  pose.pose.pose.position.x = input.number<double>();
  pose.pose.pose.position.y = input.number<double>();
  for (double& element : pose.pose.covariance) element = input.number<double>();
  fuzz::expect<std::invalid_argument>([&] {
    const SharedLocalizer::Guess guess = guessFrom(pose, "map");
    if (!guess.mean_m.allFinite() || !guess.covariance_m2.allFinite()) fuzz::fail("a guess that is not finite");
    normallyDistributed(guess.mean_m, guess.covariance_m2);
    if (searched) localizer().relocalizeAt(guess);
    fuzz::countRead();
  });
}

void loadMapBelow(fuzz::Input input) {
  const bool anywhere = input.number<std::uint8_t>() < 64;
  const std::string path = input.rest();
  fuzz::expect<MapStoreError>([&] {
    const std::string file = mapFileBelow(anywhere ? "" : "/usr/share", path);
    if (!anywhere && file.rfind("/usr/share/", 0) != 0) fuzz::fail("a map outside its folder: " + file);
    fuzz::countRead();
  });
}

void requireAnswer(std::uint8_t success, const std::string& message, double a, double b) {
  fuzz::expect<std::runtime_error>([&] {
    if (success == 0) throw std::runtime_error(message);
    if (!std::isfinite(a) || !std::isfinite(b)) fuzz::fail("a position that is nowhere");
    fuzz::countRead();
  });
}

void convert(fuzz::Input input) {
  FromLL::Request on_earth;
  on_earth.latitude = input.number<double>();
  on_earth.longitude = input.number<double>();
  const FromLL::Response in_map = fromLL(exampleMap().get(), on_earth);
  requireAnswer(in_map.success, in_map.message, in_map.map_point.x, in_map.map_point.y);
  ToLL::Request point;
  point.map_point.x = input.number<double>();
  point.map_point.y = input.number<double>();
  const ToLL::Response answer = toLL(exampleMap().get(), point);
  requireAnswer(answer.success, answer.message, answer.latitude, answer.longitude);
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  if (size == 0) return 0;
  const fuzz::Input input(data + 1, size - 1);
  switch (data[0] % 4) {
    case 0:
      relocalize(input);
      break;
    case 1:
      guessPose(input);
      break;
    case 2:
      loadMapBelow(input);
      break;
    default:
      convert(input);
  }
  return 0;
}
