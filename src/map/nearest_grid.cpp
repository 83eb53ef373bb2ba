#include "visual_localization/map/nearest_grid.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {
namespace {

constexpr double kCellsPerPosition = 16.0;
constexpr double kSmallestCell_m = 0.05;
constexpr double kMargin = 0.1;              ///< of the range, beyond the outermost positions: particles stray
constexpr std::size_t kMostCandidates = 24;  ///< beyond, a tree is as fast

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

  // Whatever is nearest to a place of the cell is hardly farther from its centre than the centre's own nearest is.
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

std::optional<NearestGrid::Found> NearestGrid::nearest(const Eigen::Vector2d& place_m) const {
  const Eigen::Vector2d cell = (place_m - min_m_) / cell_m_;
  const bool inside = cell.x() >= 0.0 && cell.y() >= 0.0 && cell.x() < static_cast<double>(columns_) &&
                      cell.y() < static_cast<double>(rows_);
  if (!inside) return std::nullopt;
  const std::size_t index = static_cast<std::size_t>(cell.y()) * columns_ + static_cast<std::size_t>(cell.x());
  const std::uint32_t begin = begins_[index];
  const std::uint32_t end = begins_[index + 1];
  if (begin == end) return std::nullopt;
  Found found{candidates_[begin], (positions_m_[candidates_[begin]] - place_m).squaredNorm()};
  for (std::uint32_t i = begin + 1; i < end; ++i) {
    const double squared_m2 = (positions_m_[candidates_[i]] - place_m).squaredNorm();
    if (squared_m2 < found.squared_m2) found = {candidates_[i], squared_m2};
  }
  return found;
}

}  // namespace visual_localization
