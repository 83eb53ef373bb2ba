// Where the fixes have the images of a session, and how its road rises and falls.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/numbers.h"
#include "base/time.h"
#include "geometry/reconstruction.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kReach_ns = 500'000'000;
constexpr double kSmallestSigma_m = 0.02;  ///< a receiver that claims less is not believed
constexpr double kLargestSigma_m = 10.0;

/// Half the way from one stamp to another, at most kReach_ns.
std::int64_t reach(std::int64_t from_ns, std::int64_t to_ns) { return std::min(kReach_ns, (to_ns - from_ns) / 2); }

Eigen::Vector2d velocityAt_m_s(const std::vector<TrajectoryPoint>& path, std::size_t i) {
  const TrajectoryPoint& before = path[i == 0 ? 0 : i - 1];
  const TrajectoryPoint& after = path[std::min(i + 1, path.size() - 1)];
  const double elapsed_s = secondsBetween(before.stamp_ns, after.stamp_ns);
  if (!(elapsed_s > 0.0)) return Eigen::Vector2d::Zero();
  return (after.position_m - before.position_m) / elapsed_s;
}

constexpr double kReach_m = 20.0;          ///< along the path
constexpr double kSlope = 0.1;             ///< of usual roads, one sigma
constexpr double kUsualSigma_m = 1.0;      ///< of an altitude whose receiver says nothing
constexpr double kSmallestRange_m = 0.01;  ///< altitudes that vary by less were not measured
constexpr std::size_t kFewest = 5;

/// An altitude somewhere along the path.
struct Altitude {
  double along_m = 0.0;
  double up_m = 0.0;
  double sigma_m = 0.0;
};

std::vector<double> distancesAlong(const std::vector<TrajectoryPoint>& images) {
  std::vector<double> along_m;
  for (std::size_t i = 0; i < images.size(); ++i) {
    along_m.push_back(i == 0 ? 0.0 : along_m.back() + (images[i].position_m - images[i - 1].position_m).norm());
  }
  return along_m;
}

/// In the order of the path. `along_m`: of the images.
std::vector<Altitude> altitudesOf(const std::vector<TrajectoryPoint>& images, const std::vector<double>& along_m,
                                  const std::vector<MapFix>& fixes) {
  const Trajectory path(images);
  std::vector<Altitude> altitudes;
  std::size_t next = 1;
  for (const MapFix& fix : fixes) {
    const std::optional<TrajectoryPoint> then = path.at(fix.stamp_ns);
    if (!then || !std::isfinite(fix.up_m)) continue;
    if (!((fix.position_m - then->position_m).norm() <= Reconstruction::kBelievedFix_m)) continue;
    while (next + 1 < images.size() && images[next].stamp_ns < fix.stamp_ns) ++next;
    const double way_m = (then->position_m - images[next - 1].position_m).norm();
    const double sigma_m = fix.sigma_up_m > 0.0 ? fix.sigma_up_m : kUsualSigma_m;
    altitudes.push_back({std::min(along_m[next - 1] + way_m, along_m[next]), fix.up_m, sigma_m});
  }
  return altitudes;
}

bool areMeasured(const std::vector<Altitude>& altitudes) {
  if (altitudes.size() < kFewest) return false;
  const auto [lowest, highest] = std::minmax_element(
      altitudes.begin(), altitudes.end(), [](const Altitude& a, const Altitude& b) { return a.up_m < b.up_m; });
  return highest->up_m - lowest->up_m >= kSmallestRange_m;
}

/// Height and slope at a distance along the path.
struct Line {
  double up_m = 0.0;
  double slope = 0.0;
};

std::optional<Line> lineAt(double along_m, const std::vector<Altitude>& altitudes) {
  const auto before = [](const Altitude& altitude, double at_m) { return altitude.along_m < at_m; };
  const auto begin = std::lower_bound(altitudes.begin(), altitudes.end(), along_m - kReach_m, before);
  const auto end = std::lower_bound(begin, altitudes.end(), along_m + kReach_m, before);
  const auto count = static_cast<double>(end - begin);
  if (count < static_cast<double>(kFewest)) return std::nullopt;
  Line mean;
  double mean_along_m = 0.0;
  for (auto altitude = begin; altitude != end; ++altitude) {
    mean.up_m += altitude->up_m / count;
    mean_along_m += altitude->along_m / count;
  }
  double squared = begin->sigma_m * begin->sigma_m / (kSlope * kSlope);
  double product = 0.0;
  for (auto altitude = begin; altitude != end; ++altitude) {
    const double offset_m = altitude->along_m - mean_along_m;
    squared += offset_m * offset_m;
    product += offset_m * (altitude->up_m - mean.up_m);
  }
  mean.slope = product / squared;
  mean.up_m += mean.slope * (along_m - mean_along_m);
  return mean;
}

}  // namespace

std::vector<FixAtImage> fixesAtImages(const std::vector<TrajectoryPoint>& images, const std::vector<MapFix>& fixes,
                                      double sigma_m) {
  const Trajectory path(images);
  std::vector<FixAtImage> found;
  auto fix = fixes.begin();
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::int64_t stamp_ns = images[i].stamp_ns;
    const std::int64_t before_ns = i == 0 ? kReach_ns : reach(images[i - 1].stamp_ns, stamp_ns);
    const std::int64_t after_ns = i + 1 == images.size() ? kReach_ns : reach(stamp_ns, images[i + 1].stamp_ns);
    while (fix != fixes.end() && fix->stamp_ns < stamp_ns - before_ns) ++fix;
    for (; fix != fixes.end() && fix->stamp_ns < stamp_ns + after_ns; ++fix) {
      const std::optional<TrajectoryPoint> then = path.at(fix->stamp_ns);
      if (!then) continue;
      const double claimed_m =
          fix->sigma_m > 0.0 ? std::clamp(fix->sigma_m, kSmallestSigma_m, kLargestSigma_m) : sigma_m;
      found.push_back({static_cast<std::uint32_t>(i), fix->stamp_ns,
                       fix->position_m + images[i].position_m - then->position_m, claimed_m, velocityAt_m_s(images, i),
                       fix->believed});
    }
  }
  return found;
}

std::vector<PositionObservation> positionsAt(const std::vector<TrajectoryPoint>& images,
                                             const std::vector<MapFix>& fixes, double sigma_m) {
  const std::vector<FixAtImage> all = fixesAtImages(images, fixes, sigma_m);
  std::vector<PositionObservation> positions;
  for (auto begin = all.begin(); begin != all.end();) {
    const auto end = std::find_if(begin, all.end(), [&](const FixAtImage& one) { return one.image != begin->image; });
    const bool believed = std::any_of(begin, end, [](const FixAtImage& one) { return one.believed; });
    std::vector<double> east;
    std::vector<double> north;
    std::vector<double> sigmas_m;
    for (auto one = begin; one != end; ++one) {
      if (one->believed != believed) continue;
      east.push_back(one->position_m.x());
      north.push_back(one->position_m.y());
      sigmas_m.push_back(one->sigma_m);
    }
    positions.push_back({begin->image, {median(east), median(north)}, median(sigmas_m), begin->velocity_m_s, believed});
    begin = end;
  }
  return positions;
}

PathHeights pathHeights(const std::vector<TrajectoryPoint>& images, const std::vector<MapFix>& fixes) {
  const PathHeights level{std::vector<double>(images.size()), std::vector<double>(images.size())};
  if (images.size() < 2) return level;
  const std::vector<double> along_m = distancesAlong(images);
  const std::vector<Altitude> altitudes = altitudesOf(images, along_m, fixes);
  if (!areMeasured(altitudes)) return level;
  PathHeights heights;
  double first_m = 0.0;
  for (const double at_m : along_m) {
    const std::optional<Line> line = lineAt(at_m, altitudes);
    if (!line) return level;
    if (heights.up_m.empty()) first_m = line->up_m;
    heights.up_m.push_back(line->up_m - first_m);
    heights.slope.push_back(line->slope);
  }
  std::vector<double> sigmas_m;
  for (const Altitude& altitude : altitudes) sigmas_m.push_back(altitude.sigma_m);
  heights.sigma_m = median(sigmas_m);
  heights.measured = true;
  return heights;
}

}  // namespace visual_localization
