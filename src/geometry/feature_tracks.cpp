#include "geometry/feature_tracks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
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

namespace {

/// Disjoint sets of features, numbered over all images.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0U); }

  std::uint32_t root(std::uint32_t i) {
    while (parents_[i] != i) {
      parents_[i] = parents_[parents_[i]];
      i = parents_[i];
    }
    return i;
  }
  /// The smaller number becomes the root, so that the result does not depend on the order of the pairs.
  void join(std::uint32_t a, std::uint32_t b) {
    const auto [small, large] = std::minmax({root(a), root(b)});
    parents_[large] = small;
  }

 private:
  std::vector<std::uint32_t> parents_;
};

bool showsAnImageTwice(const FeatureTrack& track) {
  return std::adjacent_find(track.begin(), track.end(), [](const auto& left, const auto& right) {
           return left.image == right.image;
         }) != track.end();
}

}  // namespace

std::vector<FeatureTrack> tracksOf(const std::vector<ImagePair>& pairs, const std::vector<std::size_t>& feature_counts,
                                   std::size_t min_views) {
  std::vector<std::uint32_t> first(feature_counts.size() + 1, 0);
  for (std::size_t i = 0; i < feature_counts.size(); ++i) {
    first[i + 1] = first[i] + static_cast<std::uint32_t>(feature_counts[i]);
  }
  DisjointSets sets(first.back());
  for (const ImagePair& pair : pairs) {
    for (const FeatureMatch& match : pair.matches) {
      sets.join(first[pair.a] + static_cast<std::uint32_t>(match.a),
                first[pair.b] + static_cast<std::uint32_t>(match.b));
    }
  }
  std::vector<FeatureTrack> by_root(first.back());
  for (std::uint32_t image = 0; image < feature_counts.size(); ++image) {
    for (std::uint32_t feature = 0; feature < feature_counts[image]; ++feature) {
      by_root[sets.root(first[image] + feature)].push_back({image, feature});
    }
  }
  std::vector<FeatureTrack> tracks;
  for (FeatureTrack& track : by_root) {
    if (track.size() >= min_views && !showsAnImageTwice(track)) tracks.push_back(std::move(track));
  }
  return tracks;
}

std::vector<FeatureTrack> cutTracks(const std::vector<FeatureTrack>& tracks, std::size_t max_views,
                                    const std::function<std::size_t(std::uint32_t image)>& session_of_image) {
  std::vector<FeatureTrack> cut;
  for (const FeatureTrack& track : tracks) {
    std::vector<FeatureTrack> by_session;
    for (std::size_t i = 0; i < track.size(); ++i) {
      const bool begins = i == 0 || session_of_image(track[i].image) != session_of_image(track[i - 1].image);
      if (begins) by_session.emplace_back();
      by_session.back().push_back(track[i]);
    }
    std::size_t longest = 0;
    for (const FeatureTrack& part : by_session) longest = std::max(longest, part.size());
    const std::size_t pieces = longest == 0 ? 0 : (longest - 1) / max_views + 1;
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      FeatureTrack& joined = cut.emplace_back();
      for (const FeatureTrack& part : by_session) {
        const auto at = [&](std::size_t k) {
          return part.begin() + static_cast<std::ptrdiff_t>(k * part.size() / pieces);
        };
        joined.insert(joined.end(), at(piece), at(piece + 1));
      }
    }
  }
  return cut;
}

}  // namespace visual_localization
