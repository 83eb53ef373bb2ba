#include "visual_localization/map/position_index.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

#include <nanoflann.hpp>

namespace visual_localization {
namespace {

/// The positions in the form that nanoflann asks for.
struct Points {
  std::vector<Eigen::Vector2d> positions_m;

  std::size_t kdtree_get_point_count() const { return positions_m.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return positions_m[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// The k best so far, ordered by distance and then by index. nanoflann's own result set keeps whichever of two
/// equally distant points the tree visits first.
class OrderedResults {
 public:
  using DistanceType = double;

  explicit OrderedResults(std::size_t capacity) : capacity_(capacity) { found_.reserve(capacity + 1); }

  std::size_t size() const { return found_.size(); }
  bool full() const { return found_.size() == capacity_; }
  bool addPoint(double squared_m2, std::uint32_t index) {
    const std::pair<double, std::uint32_t> candidate(squared_m2, index);
    found_.insert(std::upper_bound(found_.begin(), found_.end(), candidate), candidate);
    if (found_.size() > capacity_) found_.pop_back();
    return true;
  }
  /// Slightly more than the worst distance, because points at exactly this distance are still wanted.
  double worstDist() const {
    if (!full()) return std::numeric_limits<double>::max();
    return found_.back().first * (1.0 + 1e-9) + std::numeric_limits<double>::min();
  }
  void sort() {}

  const std::vector<std::pair<double, std::uint32_t>>& found() const { return found_; }

 private:
  std::size_t capacity_;
  std::vector<std::pair<double, std::uint32_t>> found_;
};

/// The best so far, of equals the first. Without any memory to allocate: trackers ask for it per particle and image.
class NearestResult {
 public:
  using DistanceType = double;

  std::size_t size() const { return full() ? 1 : 0; }
  bool full() const { return index_ != kNone; }
  bool addPoint(double squared_m2, std::uint32_t index) {
    if (squared_m2 > squared_m2_ || (squared_m2 == squared_m2_ && index > index_)) return true;
    squared_m2_ = squared_m2;
    index_ = index;
    return true;
  }
  double worstDist() const { return squared_m2_ * (1.0 + 1e-9) + std::numeric_limits<double>::min(); }
  void sort() {}

  Neighbour found() const { return {index_, std::sqrt(squared_m2_)}; }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  double squared_m2_ = std::numeric_limits<double>::max();
  std::uint32_t index_ = kNone;
};

}  // namespace

class PositionIndex::Tree {
 public:
  explicit Tree(std::vector<Eigen::Vector2d> positions_m)
      : points_{std::move(positions_m)}, tree_(2, points_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    // Needed up to nanoflann 1.3, where the constructor leaves the tree empty.
    tree_.buildIndex();
  }

  Neighbour nearest(const Eigen::Vector2d& position_m) const {
    NearestResult result;
    tree_.findNeighbors(result, position_m.data(), {});
    return result.found();
  }

  std::vector<Neighbour> nearest(const Eigen::Vector2d& position_m, std::size_t count) const {
    OrderedResults results(std::min(count, points_.positions_m.size()));
    tree_.findNeighbors(results, position_m.data(), {});
    std::vector<Neighbour> neighbours;
    neighbours.reserve(results.size());
    for (const auto& [squared_m2, index] : results.found()) neighbours.push_back({index, std::sqrt(squared_m2)});
    return neighbours;
  }

 private:
  using Metric = nanoflann::L2_Simple_Adaptor<double, Points>;

  Points points_;
  nanoflann::KDTreeSingleIndexAdaptor<Metric, Points, 2, std::uint32_t> tree_;
};

PositionIndex::PositionIndex(std::vector<Eigen::Vector2d> positions_m) {
  if (positions_m.empty()) throw std::invalid_argument("position index: no positions");
  if (positions_m.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw std::invalid_argument("position index: too many positions");
  }
  for (const auto& position : positions_m) {
    if (!position.allFinite()) throw std::invalid_argument("position index: a position is not finite");
  }
  tree_ = std::make_unique<Tree>(std::move(positions_m));
}

PositionIndex::~PositionIndex() = default;

Neighbour PositionIndex::nearest(const Eigen::Vector2d& position_m) const {
  if (!position_m.allFinite()) throw std::invalid_argument("position index: the position is not finite");
  return tree_->nearest(position_m);
}

std::vector<Neighbour> PositionIndex::nearest(const Eigen::Vector2d& position_m, std::size_t count) const {
  if (count == 0 || !position_m.allFinite()) return {};
  return tree_->nearest(position_m, count);
}

}  // namespace visual_localization
