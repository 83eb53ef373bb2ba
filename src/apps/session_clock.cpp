#include "apps/session_clock.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>

#include "apps/app_support.h"
#include "base/numbers.h"
#include "base/text.h"
#include "base/time.h"
#include "features/picture_motion.h"
#include "geo/clock_offset.h"

namespace visual_localization::apps {
namespace {

/// Below this an antenna ahead of the wheels looks the same: 2 m at 5 m/s. An adjustment finds the rest.
constexpr double kSmallestOffset_s = 0.4;
using Paths = std::vector<std::vector<StampedPosition>>;

constexpr double kSignificant = 4.0;  ///< sigmas

struct TimeRange {
  std::int64_t from_ns = std::numeric_limits<std::int64_t>::max();
  std::int64_t to_ns = std::numeric_limits<std::int64_t>::min();

  void extend(std::int64_t stamp_ns) {
    from_ns = std::min(from_ns, stamp_ns);
    to_ns = std::max(to_ns, stamp_ns);
  }
  bool empty() const { return to_ns < from_ns; }
};

std::string seconds(double value_s, int decimals = 2) {
  std::ostringstream out = numberStream(6);
  out << std::fixed << std::setprecision(decimals) << value_s << " s";
  return out.str();
}

std::string described(const TimeRange& range) {
  return secondsText(range.from_ns) + " to " + secondsText(range.to_ns) + " s";
}

void requireCommonTime(const BagReader& bag, const BagImages& images, const TimeRange& of_images,
                       const TimeRange& of_fixes) {
  const auto reach_ns = static_cast<std::int64_t>(kClockReach_s * 1e9);
  if (of_images.empty() || of_fixes.empty()) return;  // refused elsewhere, by what is missing
  if (of_images.from_ns <= of_fixes.to_ns + reach_ns && of_fixes.from_ns <= of_images.to_ns + reach_ns) return;
  throw BagError(bag.path() + ": fixes and images have no time in common: images of " + oneLine(images.topic()) +
                 " are stamped " + described(of_images) + ", fixes " + described(of_fixes) + ": " +
                 seconds(secondsBetween(of_images.from_ns, of_fixes.from_ns), 1) +
                 " between their first stamps: two clocks, or two recordings");
}

/// Of all fixes, and of those alone that cleaning believes: it may take turns for errors, and errors hide turns.
Paths pathsOf(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config) {
  std::vector<double> latitudes_deg;
  std::vector<double> longitudes_deg;
  for (const Fix& fix : fixes) {
    if (!hasPosition(fix)) continue;
    latitudes_deg.push_back(fix.position.latitude_deg);
    longitudes_deg.push_back(fix.position.longitude_deg);
  }
  if (latitudes_deg.size() < 2) return {};
  const LocalFrame frame({upperMedian(latitudes_deg), upperMedian(longitudes_deg), 0.0});
  std::vector<StampedPosition> all;
  for (const Fix& fix : fixes) {
    const bool later = all.empty() || fix.stamp_ns > all.back().stamp_ns;
    if (hasPosition(fix) && later) all.push_back({fix.stamp_ns, frame.toEastNorth(fix.position)});
  }
  std::vector<StampedPosition> believed;
  try {
    const CleanedTrajectory cleaned = cleanTrajectory(fixes, frame, config);
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      if (cleaned.verdicts[i] != FixVerdict::kKept) continue;
      believed.push_back({fixes[i].stamp_ns, frame.toEastNorth(fixes[i].position)});
    }
  } catch (const std::runtime_error&) {  // refused, with its reason, when the session begins
  }
  return {all, believed};
}

double medianSpeed_mps(const std::vector<StampedPosition>& path) {
  std::vector<double> speeds;
  constexpr double kSpan_s = 2.0;
  for (std::size_t i = 0, k = 0; i < path.size(); ++i) {
    while (secondsBetween(path[k].stamp_ns, path[i].stamp_ns) > kSpan_s) ++k;
    const double span_s = secondsBetween(path[k].stamp_ns, path[i].stamp_ns);
    if (span_s > 0.5 * kSpan_s) speeds.push_back((path[i].position_m - path[k].position_m).norm() / span_s);
  }
  return median(std::move(speeds));
}

std::string inWords(const ClockOffset& found) {
  std::ostringstream out = numberStream(6);
  out << std::fixed << std::setprecision(2) << std::abs(found.offset_s) << " s (sigma " << found.sigma_s << ") "
      << (found.offset_s < 0.0 ? "before" : "after") << " images of the same turn";
  return out.str();
}

bool isOffset(const ClockOffset& found) {
  return std::abs(found.offset_s) > std::max(kSmallestOffset_s, kSignificant * found.sigma_s) &&
         found.at_zero_sigmas > kSignificant;
}

/// Whether the camera is said to be upside down: then pictures turn against the path.
bool isUpsideDown(const std::optional<SensorMount>& mount) {
  return mount && (mount->camera.rotation * Eigen::Vector3d::UnitY()).z() > 0.0;
}

ClockCheck judged(const std::optional<ClockOffset>& found) {
  ClockCheck check;
  if (!found) {
    check.remark = {"clocks: not checked, since fixes and images show no turns together; a constant offset would stay"};
  } else if (found->along_rows && found->width_rad < 0.0) {
    check.remark = {"clocks: not checked: pictures turn against the path: images are mirrored or upside down", true};
  } else if (isOffset(*found)) {
    check.offset_s = found->offset_s;
    check.sigma_s = found->sigma_s;
    check.remark = {"clocks: by the turns, fixes are stamped " + inWords(*found) + ": corrected"};
  } else {
    const double known_s = 2.0 * found->sigma_s;
    const double apart_s = std::abs(found->offset_s);
    check.sigma_s = std::hypot(found->offset_s, found->sigma_s);
    check.remark = {apart_s > known_s ? "clocks: the turns leave up to " + seconds(apart_s + known_s) +
                                            " open between fixes and images"
                                      : "clocks: by the turns, fixes and images agree within " + seconds(known_s)};
    if (apart_s > std::max(known_s, kSmallestOffset_s)) {
      check.remark.text += "; landmarks tell more: calibrate, or --self-calibrate";
    }
  }
  return check;
}

/// By the path that knows the turns best.
std::optional<ClockOffset> offsetOf(const std::vector<PictureShift>& pictures, const Paths& paths) {
  std::optional<ClockOffset> best;
  for (const std::vector<StampedPosition>& path : paths) {
    const std::optional<ClockOffset> found = clockOffset(pictures, path);
    if (found && (!best || found->sigmas > best->sigmas)) best = found;
  }
  return best;
}

std::optional<ClockOffset> offsetWithin(const std::vector<PictureShift>& pictures, const Paths& paths,
                                        std::int64_t from_ns, std::int64_t to_ns) {
  std::vector<PictureShift> part;
  for (const PictureShift& picture : pictures) {
    if (picture.from_ns >= from_ns && picture.to_ns <= to_ns) part.push_back(picture);
  }
  return offsetOf(part, paths);
}

/// Within the longest pause of the images, or in their middle.
std::int64_t likelyStep_ns(const std::vector<PictureShift>& pictures) {
  constexpr double kPause_s = 10.0;
  const auto longest = std::max_element(pictures.begin(), pictures.end(), [](const auto& a, const auto& b) {
    return a.to_ns - a.from_ns < b.to_ns - b.from_ns;
  });
  if (secondsBetween(longest->from_ns, longest->to_ns) > kPause_s) return longest->from_ns;
  return pictures.front().from_ns + (pictures.back().to_ns - pictures.front().from_ns) / 2;
}

/// Nothing unless both parts know their offset and it is not the same.
std::optional<Remark> stepOf(const std::vector<PictureShift>& pictures, const Paths& paths) {
  if (pictures.empty()) return std::nullopt;
  const std::int64_t step_ns = likelyStep_ns(pictures);
  const auto first = offsetWithin(pictures, paths, pictures.front().from_ns, step_ns);
  const auto second = offsetWithin(pictures, paths, step_ns, pictures.back().to_ns);
  if (!first || !second) return std::nullopt;
  const double apart_s = std::abs(first->offset_s - second->offset_s);
  if (apart_s < kSmallestOffset_s + kSignificant * std::hypot(first->sigma_s, second->sigma_s)) return std::nullopt;
  return Remark{"clocks: by the turns, a clock steps: before " + secondsText(step_ns) + " s fixes are stamped " +
                    inWords(*first) + ", behind it " + inWords(*second) + "; not corrected: cut the bag there",
                true};
}

bool agrees(const std::optional<ClockOffset>& found) { return found && (!found->along_rows || found->width_rad > 0.0); }

constexpr double kGoesBack_s = 1.0;  ///< of stamps; less is jitter
constexpr std::size_t kMostSaid = 5;

/// `of`: what they are stamps of.
Remark goesBack(const std::string& of, double step_s, std::int64_t latest_ns) {
  return {"the stamps of " + of + " go back by " + seconds(step_s, 1) + " after " + secondsText(latest_ns) +
              " s: a clock was set, or two recordings are one; what is not later than before is left out",
          true};
}

/// Marks the longest strictly increasing sequence of the stamps from `begin` to `end`.
void useLongest(const std::vector<std::int64_t>& stamps_ns, std::size_t begin, std::size_t end,
                std::vector<bool>& used) {
  std::vector<std::size_t> ends;  // of the sequences of each length, that which ends earliest
  std::vector<std::size_t> before(stamps_ns.size());
  for (std::size_t i = begin; i < end; ++i) {
    const auto longer =
        std::lower_bound(ends.begin(), ends.end(), stamps_ns[i],
                         [&](std::size_t at, std::int64_t stamp_ns) { return stamps_ns[at] < stamp_ns; });
    before[i] = longer == ends.begin() ? i : *std::prev(longer);
    if (longer == ends.end()) {
      ends.push_back(i);
    } else {
      *longer = i;
    }
  }
  used.assign(stamps_ns.size(), false);
  if (ends.empty()) return;
  std::size_t at = ends.back();
  for (used[at] = true; before[at] != at; used[at] = true) at = before[at];
}

/// Exchanged coordinates make the mirror image of a path, stretched.
std::vector<Fix> exchangedIn(std::vector<Fix> fixes) {
  for (Fix& fix : fixes) std::swap(fix.position.latitude_deg, fix.position.longitude_deg);
  return fixes;
}

}  // namespace

ImageOrder orderOf(const std::vector<std::int64_t>& stamps_ns) {
  constexpr double kMany = 0.05;
  const std::size_t count = stamps_ns.size();
  ImageOrder order;
  useLongest(stamps_ns, 0, count, order.used);
  // Where the clock goes back; behind a single stamp far ahead it does not.
  std::vector<std::size_t> steps;
  double back_s = 0.0;
  for (std::size_t i = 1; i < count; ++i) {
    const double step_s = secondsBetween(stamps_ns[i], stamps_ns[i - 1]);
    const bool stray = i == 1 || stamps_ns[i] > stamps_ns[i - 2];
    if (step_s <= kGoesBack_s || stray) continue;
    if (steps.empty()) back_s = step_s;
    steps.push_back(i);
  }
  if (steps.size() == 1) {
    const std::size_t step = steps.front();
    const bool first = 2 * step >= count;
    useLongest(stamps_ns, first ? 0 : step, first ? step : count, order.used);
  }
  const auto out = static_cast<std::size_t>(std::count(order.used.begin(), order.used.end(), false));
  if (out == 0) return order;
  const std::string left = std::to_string(out) + " of " + std::to_string(count) + " images are left out";
  const bool many = static_cast<double>(out) > kMany * static_cast<double>(count);
  if (steps.empty()) {
    order.remark = Remark{"stamps of images are not in order: " + left, many};
  } else {
    order.remark = goesBack("images", back_s, stamps_ns[steps.front() - 1]);
    if (steps.size() > 1) order.remark->text += " (" + std::to_string(steps.size()) + " times)";
    order.remark->text += ": " + left;
  }
  return order;
}

ImageOrder orderOf(const BagReader& bag, const BagImages& images) {
  std::vector<std::int64_t> stamps_ns;
  ProgressBar bar("reading stamps");
  for (std::size_t i = 0; i < images.size(); ++i) {
    stamps_ns.push_back(images.read(i).stamp_ns);
    bar.show(i + 1, images.size());
  }
  ImageOrder order = orderOf(stamps_ns);
  const auto used = static_cast<std::size_t>(std::count(order.used.begin(), order.used.end(), true));
  if (2 * used < order.used.size()) {
    throw BagError(bag.path() + ": images of " + oneLine(images.topic()) +
                   " are out of order: " + std::to_string(order.used.size() - used) + " of " +
                   std::to_string(order.used.size()) + " are stamped not after the one that was recorded before");
  }
  return order;
}

ClockCheck checkClock(const BagReader& bag, const BagImages& images, const ImageOrder& order,
                      const std::vector<Fix>& fixes, const MapBuilderConfig& config,
                      const std::optional<SensorMount>& mount, std::size_t threads) {
  TimeRange of_images;
  TimeRange of_fixes;
  for (const Fix& fix : fixes) {
    if (hasPosition(fix)) of_fixes.extend(fix.stamp_ns);
  }
  PictureMotion motion(threads);
  {
    ProgressBar bar("comparing clocks");
    for (std::size_t i = 0; i < images.size(); ++i) {
      if (!order.used[i]) continue;
      const BagImage image = images.read(i);
      of_images.extend(image.stamp_ns);
      if (motion.wants(image.stamp_ns)) {
        try {
          motion.add(image.stamp_ns, image.decode());
        } catch (const ImageError&) {  // counted and named when features are extracted
        }
      }
      bar.show(i + 1, images.size());
    }
  }
  requireCommonTime(bag, images, of_images, of_fixes);
  std::vector<PictureShift> pictures = motion.finish();
  if (isUpsideDown(mount)) {
    for (PictureShift& picture : pictures) picture.shift = -picture.shift;
  }
  const Paths paths = pathsOf(fixes, config.trajectory);
  if (const auto step = stepOf(pictures, paths)) return {0.0, 0.0, false, *step};
  std::optional<ClockOffset> found = offsetOf(pictures, paths);
  const auto exchanged =
      agrees(found) ? std::nullopt : offsetOf(pictures, pathsOf(exchangedIn(fixes), config.trajectory));
  const bool is_exchanged = agrees(exchanged) && (!found || exchanged->sigmas > found->sigmas);
  if (is_exchanged) found = exchanged;
  // The course of an antenna ahead of the robot's origin turns before the robot does.
  if (found && mount) found->offset_s += mount->antenna_m.x() / std::max(0.1, medianSpeed_mps(paths.front()));
  ClockCheck check = judged(found);
  check.exchanged = is_exchanged;
  if (is_exchanged)
    check.remark.text = "fixes: latitude and longitude are exchanged, by the turns: put right; " + check.remark.text;
  return check;
}

std::vector<Remark> breaksOf(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config) {
  std::vector<Remark> breaks;
  std::int64_t latest_ns = fixes.empty() ? 0 : fixes.front().stamp_ns;
  for (const Fix& fix : fixes) {
    const double step_s = secondsBetween(latest_ns, fix.stamp_ns);
    if (step_s > config.max_bridge_s) {
      breaks.push_back({"fixes pause for " + seconds(step_s, 1) + " after " + secondsText(latest_ns) +
                        " s: nothing in between has a position"});
    } else if (step_s < -kGoesBack_s && (breaks.empty() || !breaks.back().disagrees)) {
      breaks.push_back(goesBack("fixes", -step_s, latest_ns));
    }
    latest_ns = std::max(latest_ns, fix.stamp_ns);
    if (breaks.size() == kMostSaid) break;
  }
  return breaks;
}

std::vector<Fix> putRight(std::vector<Fix> fixes, const ClockCheck& check) {
  const auto later_ns = static_cast<std::int64_t>(std::llround(check.offset_s * 1e9));
  for (Fix& fix : fixes) fix.stamp_ns -= later_ns;
  return check.exchanged ? exchangedIn(std::move(fixes)) : fixes;
}

}  // namespace visual_localization::apps
