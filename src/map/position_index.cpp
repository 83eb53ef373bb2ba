#include "map/position_index.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <nanoflann.hpp>

namespace visual_localization {
namespace {

/// Of more positions on exactly one spot those with the higher indices are left out: each search would look at all.
constexpr std::size_t kMostOnOneSpot = 1024;

/// All positions, but for those beyond kMostOnOneSpot, in order of index.
std::vector<std::uint32_t> soughtOf(const std::vector<Eigen::Vector2d>& positions_m) {
  std::vector<std::uint32_t> order(positions_m.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<std::uint32_t> by_spot = order;
  const auto key = [&](std::uint32_t i) { return std::tuple(positions_m[i].x(), positions_m[i].y(), i); };
  std::sort(by_spot.begin(), by_spot.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint32_t> sought;
  for (std::size_t i = 0; i < by_spot.size(); ++i) {
    const bool too_many = i >= kMostOnOneSpot && positions_m[by_spot[i]] == positions_m[by_spot[i - kMostOnOneSpot]];
    if (!too_many) sought.push_back(by_spot[i]);
  }
  if (sought.size() == order.size()) return order;
  std::sort(sought.begin(), sought.end());
  return sought;
}

/// The positions that are sought in the form that nanoflann asks for.
struct Points {
  std::vector<Eigen::Vector2d> positions_m;
  std::vector<std::uint32_t> sought;

  std::size_t kdtree_get_point_count() const { return sought.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return positions_m[sought[i]][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// The k best so far, ordered by distance and then by index. nanoflann's own result set keeps whichever of two
/// equally distant points the tree visits first. Squared distances until finish().
class OrderedResults {
 public:
  using DistanceType = double;

  OrderedResults(const std::vector<std::uint32_t>& sought, std::size_t capacity, std::vector<Neighbour>& found)
      : sought_(sought), capacity_(capacity), found_(found) {
    found_.clear();
    found_.reserve(capacity + 1);
  }

  std::size_t size() const { return found_.size(); }
  bool full() const { return found_.size() == capacity_; }
  bool addPoint(double squared_m2, std::uint32_t index) {
    const Neighbour candidate{sought_[index], squared_m2};
    const auto nearer = [](const Neighbour& a, const Neighbour& b) {
      return std::tie(a.distance_m, a.image) < std::tie(b.distance_m, b.image);
    };
    found_.insert(std::upper_bound(found_.begin(), found_.end(), candidate, nearer), candidate);
    if (found_.size() > capacity_) found_.pop_back();
    return true;
  }
  /// Slightly more than the worst distance, because points at exactly this distance are still wanted.
  double worstDist() const {
    if (!full()) return std::numeric_limits<double>::max();
    return found_.back().distance_m * (1.0 + 1e-9) + std::numeric_limits<double>::min();
  }
  void sort() {}
  void finish() {
    for (Neighbour& neighbour : found_) neighbour.distance_m = std::sqrt(neighbour.distance_m);
  }

 private:
  const std::vector<std::uint32_t>& sought_;
  std::size_t capacity_;
  std::vector<Neighbour>& found_;
};

/// The indices of the positions nearer than a radius, in the order of the search. The elements of nanoflann's own
/// result set changed their type between its versions 1.4 and 1.7.
class IndicesWithin {
 public:
  using DistanceType = double;

  IndicesWithin(double squared_radius_m2, std::vector<std::uint32_t>& found)
      : squared_radius_m2_(squared_radius_m2), found_(found) {}

  std::size_t size() const { return found_.size(); }
  bool full() const { return true; }
  bool addPoint(double squared_m2, std::uint32_t index) {
    if (squared_m2 < squared_radius_m2_) found_.push_back(index);
    return true;
  }
  double worstDist() const { return squared_radius_m2_; }
  void sort() {}

 private:
  double squared_radius_m2_;
  std::vector<std::uint32_t>& found_;
};

}  // namespace

class PositionIndex::Tree {
 public:
  explicit Tree(std::vector<Eigen::Vector2d> positions_m)
      : points_(pointsOf(std::move(positions_m))), tree_(2, points_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    // Needed up to nanoflann 1.3, where the constructor leaves the tree empty.
    tree_.buildIndex();
  }

  const std::vector<Eigen::Vector2d>& positions() const { return points_.positions_m; }

  /// In order of index.
  void within(const Eigen::Vector2d& centre_m, double radius_m, std::vector<std::uint32_t>& found) const {
    found.clear();
    IndicesWithin results(radius_m * radius_m, found);
    tree_.findNeighbors(results, centre_m.data(), {});
    for (std::uint32_t& index : found) index = points_.sought[index];
    std::sort(found.begin(), found.end());
  }
  bool seeksAll() const { return points_.sought.size() == points_.positions_m.size(); }

  void nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const {
    OrderedResults results(points_.sought, std::min(count, points_.sought.size()), found);
    tree_.findNeighbors(results, position_m.data(), {});
    results.finish();
  }

  Neighbour nearest(const Eigen::Vector2d& position_m) const {
    static thread_local std::vector<Neighbour> found;
    nearest(position_m, 1, found);
    return found.front();
  }

 private:
  using Metric = nanoflann::L2_Simple_Adaptor<double, Points>;

  static Points pointsOf(std::vector<Eigen::Vector2d> positions_m) {
    std::vector<std::uint32_t> sought = soughtOf(positions_m);
    return {std::move(positions_m), std::move(sought)};
  }

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

void PositionIndex::nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const {
  found.clear();
  if (count > 0 && position_m.allFinite()) tree_->nearest(position_m, count, found);
}

void PositionIndex::within(const Eigen::Vector2d& position_m, double radius_m,
                           std::vector<std::uint32_t>& found) const {
  constexpr double kMore_m = 1e-6;  // the tree takes what is nearer than its radius, by squares
  found.clear();
  if (!position_m.allFinite() || !(radius_m >= 0.0)) return;
  const std::vector<Eigen::Vector2d>& positions_m = tree_->positions();
  tree_->within(position_m, radius_m * (1.0 + 1e-9) + kMore_m, found);
  if (found.size() >= kMostOnOneSpot && !tree_->seeksAll()) {  // more may lie on a spot
    found.resize(positions_m.size());
    std::iota(found.begin(), found.end(), 0U);
  }
  const auto is_beyond = [&](std::uint32_t i) { return (positions_m[i] - position_m).norm() > radius_m; };
  found.erase(std::remove_if(found.begin(), found.end(), is_beyond), found.end());
}

void PositionIndex::nearest(const Eigen::Vector2d& position_m, const Search& search,
                            const std::function<bool(std::size_t)>& accept, std::vector<Neighbour>& found) const {
  constexpr std::size_t kMost = 1024;
  for (std::size_t count = search.count;; count = std::min(4 * count, kMost)) {
    nearest(position_m, count, found);
    const bool all = found.size() < count || found.back().distance_m > search.radius_m;
    const auto is_other = [&](const Neighbour& neighbour) {
      return neighbour.distance_m > search.radius_m || !accept(neighbour.image);
    };
    found.erase(std::remove_if(found.begin(), found.end(), is_other), found.end());
    if (found.size() >= search.wanted || all || count >= kMost) return;
  }
}

}  // namespace visual_localization
