#include "features/displacement_votes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

namespace visual_localization {
namespace {

constexpr int kSteps = 16;            ///< that the height of the box is counted in
constexpr double kFarthest = 8192.0;  ///< heights of a box: more than any image's; a map may claim any position

struct Displacement {
  float right_px = 0.0F;
  int down = 0;  ///< in steps
  FeatureMatch match;
};

/// How many displacements lie in the boxes that begin at each step, while those within its width are known.
class Column {
 public:
  void begin(int lowest, int highest) {
    lowest_ = lowest;
    counts_.assign(static_cast<std::size_t>(highest - lowest + kSteps), 0);
  }
  /// The most that any box with this one holds by now, and where the first of them begins.
  std::pair<int, int> add(int down) {
    int* boxes = boxesOf(down);
    for (int i = 0; i < kSteps; ++i) ++boxes[i];
    const int* most = std::max_element(boxes, boxes + kSteps);
    return {*most, down - kSteps + 1 + static_cast<int>(most - boxes)};
  }
  void remove(int down) {
    int* boxes = boxesOf(down);
    for (int i = 0; i < kSteps; ++i) --boxes[i];
  }

 private:
  /// Those that hold it: they begin from kSteps - 1 before it on.
  int* boxesOf(int down) { return counts_.data() + (down - lowest_); }

  int lowest_ = 0;
  std::vector<int> counts_;
};

void findDisplacements(const LocalFeatures& a, const LocalFeatures& b, double step_px,
                       const std::vector<FeatureMatch>& matches, std::vector<Displacement>& found) {
  found.clear();
  for (const FeatureMatch& match : matches) {
    const Keypoint& from = a.keypoints()[match.a];
    const Keypoint& to = b.keypoints()[match.b];
    const float right_px = to.x_px - from.x_px;
    const double down = static_cast<double>(to.y_px - from.y_px) / step_px;
    if (!std::isfinite(right_px) || !(std::abs(down) < kFarthest * kSteps)) continue;
    found.push_back({right_px, static_cast<int>(std::lrint(down)), match});
  }
  std::sort(found.begin(), found.end(), [](const Displacement& one, const Displacement& other) {
    return std::tie(one.right_px, one.down, one.match.a) < std::tie(other.right_px, other.down, other.match.a);
  });
}

}  // namespace

void keepLargestVote(const LocalFeatures& a, const LocalFeatures& b, double image_width_px,
                     std::vector<FeatureMatch>& matches) {
  static thread_local std::vector<Displacement> kept_displacements;
  static thread_local Column kept_column;
  std::vector<Displacement>& displacements = kept_displacements;
  Column& column = kept_column;
  const auto width_px = static_cast<float>(kVoteBoxWidth * image_width_px);
  findDisplacements(a, b, kVoteBoxHeight * image_width_px / kSteps, matches, displacements);
  matches.clear();
  if (displacements.empty()) return;
  const auto lower = [](const Displacement& one, const Displacement& other) { return one.down < other.down; };
  const auto [lowest, highest] = std::minmax_element(displacements.begin(), displacements.end(), lower);
  column.begin(lowest->down, highest->down);
  int most = 0;
  int box = 0;
  std::size_t best_first = 0;
  std::size_t best_last = 0;
  for (std::size_t first = 0, last = 0; last < displacements.size(); ++last) {
    while (displacements[last].right_px - displacements[first].right_px > width_px) {
      column.remove(displacements[first++].down);
    }
    const auto [count, begin] = column.add(displacements[last].down);
    if (count <= most) continue;
    std::tie(most, box, best_first, best_last) = std::make_tuple(count, begin, first, last);
  }
  for (std::size_t i = best_first; i <= best_last; ++i) {
    const int down = displacements[i].down;
    if (down >= box && down < box + kSteps) matches.push_back(displacements[i].match);
  }
  std::sort(matches.begin(), matches.end(),
            [](const FeatureMatch& one, const FeatureMatch& other) { return one.a < other.a; });
}

}  // namespace visual_localization
