#include "geometry/feature_tracks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Core>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr double kReach_m = 8.0;          ///< cleaned paths may be this far apart where they are one
constexpr double kBetween_m = 30.0;       ///< the way from a position back to it is at least this long
constexpr double kLargestTurn_rad = 0.8;  ///< between images that face alike
constexpr std::size_t kMostVisits = 3;

/// Images by squares of the map as wide as they may be apart.
class Grid {
 public:
  void add(std::uint32_t image, const Eigen::Vector2d& position_m) { cells_[cellOf(position_m)].push_back(image); }

  /// Calls `visit` with those in the square of a position and the eight around it.
  template <class Visit>
  void around(const Eigen::Vector2d& position_m, Visit visit) const {
    const Cell at = cellOf(position_m);
    for (std::int64_t x = at.first - 1; x <= at.first + 1; ++x) {
      for (std::int64_t y = at.second - 1; y <= at.second + 1; ++y) {
        const auto cell = cells_.find({x, y});
        if (cell == cells_.end()) continue;
        for (const std::uint32_t image : cell->second) visit(image);
      }
    }
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;

  static Cell cellOf(const Eigen::Vector2d& position_m) {
    const Eigen::Vector2d cell = position_m / kReach_m;
    return {std::llround(std::floor(cell.x())), std::llround(std::floor(cell.y()))};
  }

  std::map<Cell, std::vector<std::uint32_t>> cells_;
};

/// Travelled since the first image of all, sessions one after the other.
std::vector<double> waysOf_m(const std::vector<PathImage>& images) {
  std::vector<double> ways_m(images.size(), 0.0);
  for (std::size_t i = 1; i < images.size(); ++i) {
    const double step_m = (images[i].at.position_m - images[i - 1].at.position_m).norm();
    ways_m[i] = ways_m[i - 1] + (images[i].session == images[i - 1].session ? step_m : kBetween_m);
  }
  return ways_m;
}

struct Candidate {
  double distance_m;
  std::uint32_t image;
};

}  // namespace

std::vector<std::pair<std::uint32_t, std::uint32_t>> revisits(const std::vector<PathImage>& images) {
  const std::vector<double> ways_m = waysOf_m(images);
  Grid grid;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t i = 0; i < images.size(); ++i) {
    const TrajectoryPoint& here = images[i].at;
    std::vector<Candidate> candidates;
    grid.around(here.position_m, [&](std::uint32_t earlier) {
      const TrajectoryPoint& there = images[earlier].at;
      const double distance_m = (there.position_m - here.position_m).norm();
      if (distance_m > kReach_m || ways_m[i] - ways_m[earlier] < kBetween_m) return;
      if (std::abs(angleDifference(here.yaw_rad, there.yaw_rad)) > kLargestTurn_rad) return;
      candidates.push_back({distance_m, earlier});
    });
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      return std::pair(a.distance_m, a.image) < std::pair(b.distance_m, b.image);
    });
    std::vector<std::uint32_t> visits;
    for (const Candidate& candidate : candidates) {
      if (visits.size() == kMostVisits) break;
      const bool known = std::any_of(visits.begin(), visits.end(), [&](std::uint32_t other) {
        return std::abs(ways_m[other] - ways_m[candidate.image]) < kBetween_m;
      });
      if (known) continue;
      visits.push_back(candidate.image);
      pairs.emplace_back(candidate.image, i);
    }
    grid.add(i, here.position_m);
  }
  return pairs;
}

void FeatureSets::addImage(std::size_t features) {
  const std::size_t end = parents_.size() + features;
  ends_.push_back(static_cast<std::uint32_t>(end));
  while (parents_.size() < end) parents_.push_back(static_cast<std::uint32_t>(parents_.size()));
}

void FeatureSets::append(const FeatureSets& other) {
  const auto begin = static_cast<std::uint32_t>(parents_.size());
  for (const std::uint32_t end : other.ends_) ends_.push_back(begin + end);
  for (const std::uint32_t parent : other.parents_) parents_.push_back(begin + parent);
}

/// The smallest feature of a set is its root, whatever the order.
void FeatureSets::join(const ImagePair& pair) {
  const auto find = [this](std::uint32_t image, std::uint32_t feature) {
    std::uint32_t i = feature + (image == 0 ? 0 : ends_[image - 1]);
    for (; parents_[i] != i; i = parents_[i]) parents_[i] = parents_[parents_[i]];
    return i;
  };
  for (const FeatureMatch& match : pair.matches) {
    const auto [small, large] = std::minmax({find(pair.a, match.a), find(pair.b, match.b)});
    parents_[large] = small;
  }
}

namespace {

bool showsAnImageTwice(const FeatureTrack& track) {
  return std::adjacent_find(track.begin(), track.end(), [](const auto& left, const auto& right) {
           return left.image == right.image;
         }) != track.end();
}

}  // namespace

std::vector<FeatureTrack> FeatureSets::tracks(std::size_t min_views) const {
  std::vector<std::uint32_t> roots = parents_;
  std::vector<std::uint32_t> sizes(parents_.size(), 0);
  for (std::uint32_t& root : roots) {
    root = roots[root];
    ++sizes[root];
  }
  std::vector<std::uint32_t> track_of(parents_.size(), 0);  // by root
  std::vector<FeatureTrack> tracks;
  std::uint32_t i = 0;
  for (std::uint32_t image = 0; image < ends_.size(); ++image) {
    for (std::uint32_t feature = 0; i < ends_[image]; ++i, ++feature) {
      const std::uint32_t root = roots[i];
      if (sizes[root] < min_views) continue;
      if (root == i) {
        track_of[root] = static_cast<std::uint32_t>(tracks.size());
        tracks.emplace_back().reserve(sizes[root]);
      }
      tracks[track_of[root]].push_back({image, feature});
    }
  }
  tracks.erase(std::remove_if(tracks.begin(), tracks.end(), showsAnImageTwice), tracks.end());
  return tracks;
}

std::vector<FeatureTrack> cutTrack(const FeatureTrack& track, std::size_t max_views,
                                   const std::function<std::size_t(std::uint32_t image)>& session_of_image) {
  std::vector<FeatureTrack> by_session;
  for (std::size_t i = 0; i < track.size(); ++i) {
    const bool begins = i == 0 || session_of_image(track[i].image) != session_of_image(track[i - 1].image);
    if (begins) by_session.emplace_back();
    by_session.back().push_back(track[i]);
  }
  std::size_t longest = 0;
  for (const FeatureTrack& part : by_session) longest = std::max(longest, part.size());
  std::vector<FeatureTrack> pieces(longest == 0 ? 0 : (longest - 1) / max_views + 1);
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    for (const FeatureTrack& part : by_session) {
      const auto at = [&](std::size_t piece) {
        return part.begin() + static_cast<std::ptrdiff_t>(piece * part.size() / pieces.size());
      };
      pieces[k].insert(pieces[k].end(), at(k), at(k + 1));
    }
  }
  return pieces;
}

namespace {

constexpr double kNearest_m = 0.1;  ///< a point closer to a camera than this is none

Eigen::Vector3d direction(const Sight& sight) {
  return sight.camera->rotation * sight.normalised.homogeneous().normalized();
}

/// The direction farthest from `from`.
Eigen::Vector3d farthest(const Eigen::Vector3d& from, const std::vector<Sight>& sights) {
  Eigen::Vector3d found = from;
  for (const Sight& sight : sights) {
    const Eigen::Vector3d other = direction(sight);
    if (from.dot(other) < from.dot(found)) found = other;
  }
  return found;
}

/// Exactly for rays in a plane, as those from a path; of others nearly.
double widestAngle_rad(const std::vector<Sight>& sights) {
  const Eigen::Vector3d one_end = farthest(direction(sights.front()), sights);
  return std::acos(std::clamp(one_end.dot(farthest(one_end, sights)), -1.0, 1.0));
}

}  // namespace

std::optional<Eigen::Vector3d> triangulate(const std::vector<Sight>& sights, double min_angle_rad) {
  if (sights.size() < 2 || widestAngle_rad(sights) < min_angle_rad) return std::nullopt;
  const Eigen::Vector3d& origin = sights.front().camera->position_m;  // keeps the sums small
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  for (const Sight& sight : sights) {
    const Eigen::Vector3d ray = direction(sight);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    sum += across;
    weighted += across * (sight.camera->position_m - origin);
  }
  const Eigen::Vector3d point = origin + Eigen::Vector3d(sum.ldlt().solve(weighted));
  const bool visible = point.allFinite() && std::all_of(sights.begin(), sights.end(), [&point](const Sight& sight) {
                         return sight.camera->toCamera(point).z() > kNearest_m;
                       });
  return visible ? std::optional<Eigen::Vector3d>(point) : std::nullopt;
}

}  // namespace visual_localization
