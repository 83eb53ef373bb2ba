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

constexpr double kCellsPerPosition = 16.0;
constexpr double kSmallestCell_m = 0.05;
constexpr double kMargin = 0.1;              ///< of the range, beyond the outermost positions: particles stray
constexpr std::size_t kMostCandidates = 24;  ///< beyond, a tree is as fast

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

/// The indices of the positions nearer than a radius, in the order of the search; the search ends as soon as there are
/// more than `most`. The elements of nanoflann's own result set changed their type between its versions 1.4 and 1.7.
class IndicesWithin {
 public:
  using DistanceType = double;

  IndicesWithin(double squared_radius_m2, std::size_t most, std::vector<std::uint32_t>& found)
      : squared_radius_m2_(squared_radius_m2), most_(most), found_(found) {}

  std::size_t size() const { return found_.size(); }
  bool full() const { return true; }
  bool addPoint(double squared_m2, std::uint32_t index) {
    if (squared_m2 < squared_radius_m2_) found_.push_back(index);
    return found_.size() <= most_;
  }
  double worstDist() const { return found_.size() <= most_ ? squared_radius_m2_ : -1.0; }
  void sort() {}

 private:
  double squared_radius_m2_;
  std::size_t most_;
  std::vector<std::uint32_t>& found_;
};

/// The distance to the nearest position, or a billionth more: positions that are hardly nearer than the best so far are
/// not looked at, so that many on one spot take no longer than one.
class NearlyLeastDistance {
 public:
  using DistanceType = double;

  std::size_t size() const { return 1; }
  bool full() const { return true; }
  bool addPoint(double squared_m2, std::uint32_t) {
    squared_m2_ = std::min(squared_m2_, squared_m2);
    return true;
  }
  double worstDist() const {
    constexpr double kHardlyNearer = 1.0 - 1e-9;
    return kHardlyNearer * squared_m2_ - std::numeric_limits<double>::min();
  }
  void sort() {}
  double distance_m() const { return std::sqrt(squared_m2_); }

 private:
  double squared_m2_ = std::numeric_limits<double>::max();
};

/// Positions up to this number get a grid; building one for a city would take longer than it saves.
constexpr std::size_t kLargestGrid = 20000;

}  // namespace

NearestGrid::NearestGrid(const std::vector<Eigen::Vector2d>& positions_m, const Distance& distance,
                         const Within& within)
    : positions_m_(positions_m) {
  Eigen::Vector2d max_m = positions_m.front();
  min_m_ = max_m;
  for (const Eigen::Vector2d& position : positions_m) {
    min_m_ = min_m_.cwiseMin(position);
    max_m = max_m.cwiseMax(position);
  }
  const double margin_m = kMargin * (max_m - min_m_).maxCoeff();
  min_m_.array() -= margin_m;
  const Eigen::Vector2d range_m = (max_m - min_m_).array() + margin_m;
  const double cells = kCellsPerPosition * static_cast<double>(positions_m.size());
  cell_m_ = std::max(kSmallestCell_m, std::sqrt(range_m.x() * range_m.y() / cells));
  columns_ = static_cast<std::size_t>(range_m.x() / cell_m_) + 1;
  rows_ = static_cast<std::size_t>(range_m.y() / cell_m_) + 1;

  // Whatever is nearest to a position of the cell is hardly farther from its centre than the centre's own nearest is.
  const double reach_m = std::sqrt(2.0) * cell_m_ * (1.0 + 1e-9);
  begins_.push_back(0);
  for (std::size_t cell = 0; cell < columns_ * rows_; ++cell) {
    const Eigen::Vector2d centre_m(min_m_.x() + (static_cast<double>(cell % columns_) + 0.5) * cell_m_,
                                   min_m_.y() + (static_cast<double>(cell / columns_) + 0.5) * cell_m_);
    const std::vector<std::uint32_t> found = within(centre_m, distance(centre_m) + reach_m);
    if (found.size() <= kMostCandidates) candidates_.insert(candidates_.end(), found.begin(), found.end());
    begins_.push_back(static_cast<std::uint32_t>(candidates_.size()));
  }
}

std::optional<NearestGrid::Found> NearestGrid::nearest(const Eigen::Vector2d& position_m) const {
  const Eigen::Vector2d cell = (position_m - min_m_) / cell_m_;
  const bool inside = cell.x() >= 0.0 && cell.y() >= 0.0 && cell.x() < static_cast<double>(columns_) &&
                      cell.y() < static_cast<double>(rows_);
  if (!inside) return std::nullopt;
  const std::size_t index = static_cast<std::size_t>(cell.y()) * columns_ + static_cast<std::size_t>(cell.x());
  const std::uint32_t begin = begins_[index];
  const std::uint32_t end = begins_[index + 1];
  if (begin == end) return std::nullopt;
  Found found{candidates_[begin], (positions_m_[candidates_[begin]] - position_m).squaredNorm()};
  for (std::uint32_t i = begin + 1; i < end; ++i) {
    const double squared_m2 = (positions_m_[candidates_[i]] - position_m).squaredNorm();
    if (squared_m2 < found.squared_m2) found = {candidates_[i], squared_m2};
  }
  return found;
}

class PositionIndex::Tree {
 public:
  explicit Tree(std::vector<Eigen::Vector2d> positions_m)
      : points_(pointsOf(std::move(positions_m))), tree_(2, points_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    // Needed up to nanoflann 1.3, where the constructor leaves the tree empty.
    tree_.buildIndex();
  }

  const std::vector<Eigen::Vector2d>& positions() const { return points_.positions_m; }

  /// In order of index; when there are more than `most`, any of them, but more than `most`.
  void within(const Eigen::Vector2d& centre_m, double radius_m, std::size_t most,
              std::vector<std::uint32_t>& found) const {
    found.clear();
    IndicesWithin results(radius_m * radius_m, most, found);
    tree_.findNeighbors(results, centre_m.data(), {});
    for (std::uint32_t& index : found) index = points_.sought[index];
    std::sort(found.begin(), found.end());
  }
  bool seeksAll() const { return points_.sought.size() == points_.positions_m.size(); }

  double nearlyLeastDistance_m(const Eigen::Vector2d& position_m) const {
    NearlyLeastDistance result;
    tree_.findNeighbors(result, position_m.data(), {});
    return result.distance_m();
  }

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
  if (tree_->positions().size() > kLargestGrid) return;
  grid_ = std::make_unique<NearestGrid>(
      tree_->positions(),
      [this](const Eigen::Vector2d& position_m) { return tree_->nearlyLeastDistance_m(position_m); },
      [this](const Eigen::Vector2d& centre_m, double radius_m) {
        std::vector<std::uint32_t> found;
        tree_->within(centre_m, radius_m, kMostCandidates, found);
        return found;
      });
}

PositionIndex::~PositionIndex() = default;

Neighbour PositionIndex::nearest(const Eigen::Vector2d& position_m) const {
  if (!position_m.allFinite()) throw std::invalid_argument("position index: the position is not finite");
  const auto found = grid_ ? grid_->nearest(position_m) : std::nullopt;
  return found ? Neighbour{found->index, std::sqrt(found->squared_m2)} : tree_->nearest(position_m);
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
  tree_->within(position_m, radius_m * (1.0 + 1e-9) + kMore_m, positions_m.size(), found);
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
