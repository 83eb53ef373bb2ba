#include "geometry/path_doubts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kFails = 11.83;     ///< squared sigmas of two axes, as unlikely as three sigmas on a line
constexpr double kWindow_m = 100.0;  ///< of path whose shape is compared
constexpr double kWindowStep_m = 25.0;
constexpr double kJoined_m = 25.0;  ///< stretches nearer to each other are one

double sigmaFound_m(const PathEvidence& at, double path_sigma_m) {
  const double fix_m2 = at.fix_sigma_m * at.fix_sigma_m;
  const double off_m2 = at.off_fixes_m->squaredNorm();
  if (off_m2 <= kFails * (fix_m2 + path_sigma_m * path_sigma_m)) return 0.0;
  return std::sqrt(std::max(0.0, 0.5 * off_m2 - fix_m2));
}

/// Of each image along the path, from the first one.
std::vector<double> alongOf_m(const std::vector<PathEvidence>& path) {
  std::vector<double> along_m;
  for (std::size_t i = 0; i < path.size(); ++i) {
    along_m.push_back(i == 0 ? 0.0 : along_m.back() + (path[i].position_m - path[i - 1].position_m).norm());
  }
  return along_m;
}

/// The first and the last image of stretches that fail.
struct Failure {
  std::size_t first = 0;
  std::size_t last = 0;
};

std::vector<Failure> failuresOf(const std::vector<PathDoubt>& doubts, const std::vector<double>& along_m) {
  std::vector<Failure> failures;
  for (std::size_t i = 0; i < doubts.size(); ++i) {
    if (!doubts[i].fails) continue;
    if (failures.empty() || along_m[i] - along_m[failures.back().last] > kJoined_m) failures.push_back({i, i});
    failures.back().last = i;
  }
  return failures;
}

/// Images that fixes say something about. Fixes that are off pull the path beside them about as far as they reach
/// themselves: what agrees there confirms nothing.
std::vector<bool> judgedByFixes(const std::vector<PathEvidence>& path, const std::vector<double>& along_m,
                                const std::vector<PathDoubt>& doubts) {
  std::vector<bool> judged;
  for (const PathEvidence& at : path) judged.push_back(at.off_fixes_m.has_value());
  for (const auto& [first, last] : failuresOf(doubts, along_m)) {
    const double reach_m = along_m[last] - along_m[first];
    for (std::size_t i = 0; i < path.size(); ++i) {
      const bool is_beside = along_m[i] >= along_m[first] - reach_m && along_m[i] <= along_m[last] + reach_m;
      if (is_beside && !doubts[i].fails) judged[i] = false;
    }
  }
  return judged;
}

using Nearest = std::vector<std::optional<std::size_t>>;

/// Of each image the last one before it that is judged, itself included, as far as images show the same all the way.
Nearest judgedBefore(const std::vector<PathEvidence>& path, const std::vector<bool>& judged) {
  Nearest nearest;
  for (std::size_t i = 0; i < path.size(); ++i) {
    nearest.push_back(judged[i]                     ? std::optional<std::size_t>(i)
                      : i > 0 && path[i].turned_rad ? nearest[i - 1]
                                                    : std::nullopt);
  }
  return nearest;
}

/// The first one behind it.
Nearest judgedBehind(const std::vector<PathEvidence>& path, const std::vector<bool>& judged) {
  Nearest nearest(path.size());
  for (std::size_t i = path.size(); i-- > 0;) {
    if (judged[i]) {
      nearest[i] = i;
    } else if (i + 1 < path.size() && path[i + 1].turned_rad) {
      nearest[i] = nearest[i + 1];
    }
  }
  return nearest;
}

/// What was found at an image itself, or in between in proportion to the time, and what images stray on the way.
void doubtByFixes(const std::vector<PathEvidence>& path, double path_sigma_m, const std::vector<double>& along_m,
                  std::vector<PathDoubt>& doubts) {
  std::vector<double> found_m(path.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path[i].off_fixes_m) found_m[i] = sigmaFound_m(path[i], path_sigma_m);
    doubts[i].fails = found_m[i] > 0.0;
  }
  const std::vector<bool> judged = judgedByFixes(path, along_m, doubts);
  const Nearest before = judgedBefore(path, judged);
  const Nearest behind = judgedBehind(path, judged);
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!before[i] && !behind[i]) {
      doubts[i].by_fixes_m = kDrift * along_m.back();
      continue;
    }
    const std::size_t a = before[i].value_or(*behind[i]);
    const std::size_t b = behind[i].value_or(a);
    const double span_s = secondsBetween(path[a].stamp_ns, path[b].stamp_ns);
    const double share = a == b ? 0.0 : secondsBetween(path[a].stamp_ns, path[i].stamp_ns) / span_s;
    const double way_m = std::min(std::abs(along_m[i] - along_m[a]), std::abs(along_m[b] - along_m[i]));
    doubts[i].by_fixes_m = (1.0 - share) * found_m[a] + share * found_m[b] + kDrift * way_m;
  }
}

/// Images [begin, end) of the path.
struct Window {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Of kWindow_m, where images show what those before them show.
std::vector<Window> windowsOf(const std::vector<PathEvidence>& path, const std::vector<double>& along_m) {
  std::vector<Window> windows;
  std::size_t begin = 0;
  while (begin < path.size()) {
    std::size_t next = begin;
    std::size_t end = begin + 1;
    for (; end < path.size() && path[end].turned_rad && along_m[end - 1] - along_m[begin] < kWindow_m; ++end) {
      if (next == begin && along_m[end] - along_m[begin] >= kWindowStep_m) next = end;
    }
    windows.push_back({begin, end});
    const bool is_last = end == path.size() || !path[end].turned_rad;
    begin = is_last || next == begin ? end : next;
  }
  return windows;
}

/// Images of the window as the path has them, and on a path that has its steps and turns as the images do; both about
/// their middle.
struct Shapes {
  std::vector<Eigen::Vector2d> adjusted_m;
  std::vector<Eigen::Vector2d> by_turns_m;
};

void centre(std::vector<Eigen::Vector2d>& shape_m) {
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& at_m : shape_m) sum_m += at_m;
  for (Eigen::Vector2d& at_m : shape_m) at_m -= sum_m / static_cast<double>(shape_m.size());
}

Shapes shapesOf(const std::vector<PathEvidence>& path, const Window& window) {
  Shapes shapes;
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();
  double turned_rad = 0.0;
  for (std::size_t i = window.begin; i < window.end; ++i) {
    if (i > window.begin) {
      at_m += Eigen::Rotation2Dd(turned_rad) * (path[i].position_m - path[i - 1].position_m);
      turned_rad += *path[i].turned_rad;
    }
    shapes.adjusted_m.push_back(path[i].position_m);
    shapes.by_turns_m.push_back(at_m);
  }
  centre(shapes.adjusted_m);
  centre(shapes.by_turns_m);
  return shapes;
}

/// The largest distance between them, per axis, when one is turned onto the other.
double shapeError_m(const Shapes& shapes) {
  double along = 0.0;
  double across = 0.0;
  for (std::size_t i = 0; i < shapes.adjusted_m.size(); ++i) {
    const Eigen::Vector2d& from_m = shapes.by_turns_m[i];
    along += from_m.dot(shapes.adjusted_m[i]);
    across += from_m.x() * shapes.adjusted_m[i].y() - from_m.y() * shapes.adjusted_m[i].x();
  }
  const Eigen::Rotation2Dd turn(std::atan2(across, along));
  double largest_m2 = 0.0;
  for (std::size_t i = 0; i < shapes.adjusted_m.size(); ++i) {
    largest_m2 = std::max(largest_m2, (turn * shapes.by_turns_m[i] - shapes.adjusted_m[i]).squaredNorm());
  }
  return std::sqrt(0.5 * largest_m2);
}

/// Whether the path turns in it: a straight one has the shape of any other.
bool turns(const std::vector<PathEvidence>& path, const Window& window) {
  constexpr double kTurn_rad = 0.5;
  std::optional<double> first_rad;
  for (std::size_t i = window.begin + 1; i < window.end; ++i) {
    const Eigen::Vector2d step_m = path[i].position_m - path[i - 1].position_m;
    if (step_m.isZero()) continue;
    const double course_rad = std::atan2(step_m.y(), step_m.x());
    if (!first_rad) first_rad = course_rad;
    if (std::abs(angleDifference(*first_rad, course_rad)) > kTurn_rad) return true;
  }
  return false;
}

/// Only a window that turns and fits confirms the path: from one to the next such, as far as images show the same all
/// the way, the largest that was found counts.
std::vector<double> carriedOn(const std::vector<PathEvidence>& path, const std::vector<Window>& windows,
                              std::vector<double> off_m) {
  const auto pass = [&](std::size_t w, std::size_t from) {
    const bool is_joined = windows[std::max(w, from)].begin < windows[std::min(w, from)].end;
    const bool fits = off_m[w] == 0.0 && turns(path, windows[w]);
    if (is_joined && !fits) off_m[w] = std::max(off_m[w], off_m[from]);
  };
  for (std::size_t w = 1; w < windows.size(); ++w) pass(w, w - 1);
  for (std::size_t w = windows.size(); w-- > 1;) pass(w - 1, w);
  return off_m;
}

/// Nobody knows where in the window the path goes wrong.
void doubtByTurns(const std::vector<PathEvidence>& path, double path_sigma_m, const std::vector<double>& along_m,
                  std::vector<PathDoubt>& doubts) {
  const std::vector<Window> windows = windowsOf(path, along_m);
  std::vector<double> off_m;
  for (const Window& window : windows) {
    const double here_m = shapeError_m(shapesOf(path, window));
    const double way_m = along_m[window.end - 1] - along_m[window.begin];
    off_m.push_back(here_m > path_sigma_m + 0.5 * kDrift * way_m ? here_m : 0.0);
  }
  off_m = carriedOn(path, windows, std::move(off_m));
  for (std::size_t w = 0; w < windows.size(); ++w) {
    if (off_m[w] == 0.0) continue;
    for (std::size_t i = windows[w].begin; i < windows[w].end; ++i) {
      doubts[i].by_turns_m = std::max(doubts[i].by_turns_m, off_m[w]);
      doubts[i].fails = true;
    }
  }
}

}  // namespace

double PathDoubt::m() const { return std::hypot(by_fixes_m, by_turns_m); }

std::vector<PathDoubt> doubtsOf(const std::vector<PathEvidence>& path, double path_sigma_m) {
  std::vector<PathDoubt> doubts(path.size());
  if (path.empty()) return doubts;
  const std::vector<double> along_m = alongOf_m(path);
  doubtByFixes(path, path_sigma_m, along_m, doubts);
  doubtByTurns(path, path_sigma_m, along_m, doubts);
  return doubts;
}

std::vector<DoubtfulStretch> doubtfulStretches(const std::vector<PathEvidence>& path,
                                               const std::vector<PathDoubt>& doubts,
                                               const std::vector<double>& sigmas_m) {
  std::vector<DoubtfulStretch> stretches;
  const std::vector<double> along_m = alongOf_m(path);
  for (const auto& [first, last] : failuresOf(doubts, along_m)) {
    DoubtfulStretch stretch{path[first].stamp_ns, path[last].stamp_ns, along_m[first], along_m[last]};
    for (std::size_t i = first; i <= last; ++i) {
      stretch.sigma_m = std::max(stretch.sigma_m, sigmas_m[i]);
      stretch.off_turns_m = std::max(stretch.off_turns_m, doubts[i].by_turns_m);
      if (path[i].off_fixes_m) stretch.off_fixes_m = std::max(stretch.off_fixes_m, path[i].off_fixes_m->norm());
    }
    stretches.push_back(stretch);
  }
  return stretches;
}

}  // namespace visual_localization
