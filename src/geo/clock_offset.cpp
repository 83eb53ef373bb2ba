#include "geo/clock_offset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include <unsupported/Eigen/FFT>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

using Spectrum = std::vector<std::complex<double>>;

// Chosen while looking at 213 pairs of images and fixes of different drives, none of which passes these three together;
// drives of their own with turns have 9 to 30 and 5.7 to 12 sigmas.
constexpr double kLeastSigmas = 7.0;       ///< against the errors that are left once the turns are explained
constexpr double kLeastBlindSigmas = 4.5;  ///< against the path's own spectrum, in which the turns themselves count
/// Without the one turn that says most: a swerve looks like a jump of the fixes. Drives of their own have 6.9 to 27
/// sigmas without it, two thirds of all or more; 325 foreign ones with jumps at most 4.6, and 0.36.
constexpr double kLeastSigmasOfOthers = 5.5;
constexpr double kLeastShareOfOthers = 0.5;
constexpr double kOneTurn_s = 6.0;
constexpr double kNarrowest_rad = 0.3;  ///< angle of view of a lens
constexpr double kWidest_rad = 3.0;

constexpr std::size_t kFewestSteps = 40;  ///< fewer say nothing about their own spectrum
constexpr std::size_t kFiner = 16;        ///< steps of the correlation in a step of the path
constexpr double kLargestTurn_rad = 1.0;  ///< in a step; more is an outlier

/// A function of time by its values, linear between them and constant beyond.
struct Curve {
  std::vector<double> time_s;
  std::vector<double> value;

  double at(double t_s) const {
    const auto after = std::upper_bound(time_s.begin(), time_s.end(), t_s);
    if (after == time_s.begin()) return value.front();
    if (after == time_s.end()) return value.back();
    const auto i = static_cast<std::size_t>(after - time_s.begin());
    const double share = (t_s - time_s[i - 1]) / (time_s[i] - time_s[i - 1]);
    return value[i - 1] + share * (value[i] - value[i - 1]);
  }
};

/// Turns of the path from one step of `step_s` to the next; the first is about `start_s`. 0 where it is not known.
struct PathTurns {
  double step_s = 0.0;
  double start_s = 0.0;
  std::vector<double> turn_rad;
};

double meanAround(const Curve& curve, double t_s, double width_s) {
  constexpr int kSamples = 8;
  double sum = 0.0;
  for (int k = 0; k < kSamples; ++k) sum += curve.at(t_s + width_s * ((k + 0.5) / kSamples - 0.5));
  return sum / kSamples;
}

/// As the course of a step between two means of the path shows it: weighted by a triangle.
double triangleAround(const Curve& curve, double t_s, double half_width_s) {
  constexpr int kSamples = 32;
  double sum = 0.0;
  double weights = 0.0;
  for (int k = 0; k < kSamples; ++k) {
    const double at = 2.0 * (k + 0.5) / kSamples - 1.0;
    sum += (1.0 - std::abs(at)) * curve.at(t_s + half_width_s * at);
    weights += 1.0 - std::abs(at);
  }
  return sum / weights;
}

double medianLength(const std::vector<Eigen::Vector2d>& vectors) {
  std::vector<double> lengths;
  for (const Eigen::Vector2d& vector : vectors) lengths.push_back(vector.norm());
  return median(std::move(lengths));
}

double medianStep_s(const std::vector<double>& times_s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times_s.size(); ++i) steps.push_back(times_s[i] - times_s[i - 1]);
  return median(std::move(steps));
}

std::vector<Eigen::Vector2d> stepsOf(const Curve& east, const Curve& north, double step_s) {
  const double from_s = east.time_s.front() + 0.5 * step_s;
  const auto count = static_cast<std::size_t>(std::max(0.0, (east.time_s.back() - from_s) / step_s));
  std::vector<Eigen::Vector2d> steps;
  Eigen::Vector2d last = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < count; ++k) {
    const double t_s = from_s + static_cast<double>(k) * step_s;
    const Eigen::Vector2d here(meanAround(east, t_s, step_s), meanAround(north, t_s, step_s));
    if (k > 0) steps.emplace_back(here - last);
    last = here;
  }
  return steps;
}

bool isGap(const std::vector<double>& times_s, double t_s, double longest_s) {
  const auto after = std::upper_bound(times_s.begin(), times_s.end(), t_s);
  return after != times_s.begin() && after != times_s.end() && *after - *std::prev(after) > longest_s;
}

/// In the shortest steps that are long against the noise of the fixes; nothing when there are none.
std::optional<PathTurns> turnsOf(const Curve& east, const Curve& north, double image_step_s) {
  constexpr double kLargestNoise = 0.25;  // of a step's length, so that a course is an angle and no guess
  constexpr double kStands = 0.3;         // of the usual step
  constexpr std::array<double, 6> kSteps_s{0.25, 0.5, 1.0, 2.0, 4.0, 8.0};
  const double fix_step_s = medianStep_s(east.time_s);
  for (const double step_s : kSteps_s) {
    if (step_s < 0.9 * fix_step_s || step_s < 0.45 * image_step_s) continue;
    const std::vector<Eigen::Vector2d> steps = stepsOf(east, north, step_s);
    if (steps.size() < kFewestSteps) return std::nullopt;
    std::vector<Eigen::Vector2d> changes;
    for (std::size_t k = 1; k < steps.size(); ++k) changes.emplace_back(steps[k] - steps[k - 1]);
    const double usual_m = medianLength(steps);
    if (!(medianLength(changes) < kLargestNoise * usual_m)) continue;
    PathTurns turns{step_s, east.time_s.front() + 1.5 * step_s, {}};
    for (std::size_t k = 1; k < steps.size(); ++k) {
      const double at_s = turns.start_s + static_cast<double>(k - 1) * step_s;
      const bool known = std::min(steps[k].norm(), steps[k - 1].norm()) > kStands * usual_m &&
                         !isGap(east.time_s, at_s, std::max(3.0 * fix_step_s, 2.0 * step_s));
      const double turn_rad =
          std::atan2(steps[k - 1].x() * steps[k].y() - steps[k - 1].y() * steps[k].x(), steps[k - 1].dot(steps[k]));
      turns.turn_rad.push_back(known ? std::clamp(turn_rad, -kLargestTurn_rad, kLargestTurn_rad) : 0.0);
    }
    return turns;
  }
  return std::nullopt;
}

/// Of the pictures in the same steps, from `beyond` steps before the path to as many behind it.
std::vector<double> turnsOf(const Curve& picture, const PathTurns& path, std::size_t beyond) {
  const std::size_t count = path.turn_rad.size() + 2 * beyond;
  std::vector<double> turns(count, 0.0);
  double sum = 0.0;
  std::size_t inside = 0;
  const auto timeOf = [&](std::size_t k) {
    return path.start_s + (static_cast<double>(k) - static_cast<double>(beyond)) * path.step_s;
  };
  const auto isInside = [&](std::size_t k) {
    return timeOf(k) >= picture.time_s.front() && timeOf(k) <= picture.time_s.back();
  };
  for (std::size_t k = 0; k < count; ++k) {
    if (!isInside(k)) continue;
    turns[k] = triangleAround(picture, timeOf(k) + 0.5 * path.step_s, path.step_s) -
               triangleAround(picture, timeOf(k) - 0.5 * path.step_s, path.step_s);
    sum += turns[k];
    ++inside;
  }
  // A camera that looks aside sees the world pass by: that is no turn.
  for (std::size_t k = 0; k < count; ++k) turns[k] -= isInside(k) ? sum / static_cast<double>(inside) : 0.0;
  return turns;
}

/// Hann-weighted over neighbouring frequencies, mirrored at both ends.
std::vector<double> smoothed(const std::vector<double>& power, std::size_t half_width) {
  const auto last = static_cast<std::ptrdiff_t>(power.size()) - 1;
  const auto reach = static_cast<std::ptrdiff_t>(half_width);
  std::vector<double> smooth(power.size(), 0.0);
  for (std::ptrdiff_t k = 0; k <= last; ++k) {
    double weights = 0.0;
    double sum = 0.0;
    for (std::ptrdiff_t d = -reach; d <= reach; ++d) {
      std::ptrdiff_t at = std::abs(k + d);
      if (at > last) at = std::max<std::ptrdiff_t>(0, 2 * last - at);
      const double weight = 1.0 + std::cos(kPi * static_cast<double>(d) / static_cast<double>(reach + 1));
      sum += weight * power[static_cast<std::size_t>(at)];
      weights += weight;
    }
    smooth[static_cast<std::size_t>(k)] = sum / weights;
  }
  return smooth;
}

/// Noise of the path by frequency, never quite 0.
std::vector<double> noiseOf(const Spectrum& spectrum, std::size_t half_width) {
  std::vector<double> power;
  double mean = 0.0;
  for (const std::complex<double>& value : spectrum) {
    power.push_back(std::norm(value));
    mean += std::norm(value) / static_cast<double>(spectrum.size());
  }
  std::vector<double> noise = smoothed(power, half_width);
  for (double& value : noise) value = std::max(value, std::max(1e-3 * mean, 1e-300));
  return noise;
}

/// The correlation of a path and pictures by their offset.
class TurnCorrelation {
 public:
  TurnCorrelation(const PathTurns& path, const Curve& picture) : step_s_(path.step_s), steps_(path.turn_rad.size()) {
    const auto beyond = static_cast<std::size_t>(kClockReach_s / step_s_) + 2;
    while (length_ < steps_ + 3 * beyond) length_ *= 2;
    std::vector<double> turns(beyond, 0.0);
    turns.insert(turns.end(), path.turn_rad.begin(), path.turn_rad.end());
    path_ = spectrumOf(std::move(turns));
    picture_ = spectrumOf(turnsOf(picture, path, beyond));
  }

  /// Nothing when it has no peak that stands out.
  std::optional<ClockOffset> peak() {
    std::vector<double> noise = noiseOf(path_, halfWidth());
    correlate(noise);
    if (gain_[best_] < kLeastBlindSigmas * kLeastBlindSigmas) return std::nullopt;
    for (int pass = 0; pass < 2; ++pass) {
      noise = noiseOf(unexplained(), halfWidth());
      correlate(noise);
    }
    if (gain_[best_] < kLeastSigmas * kLeastSigmas) return std::nullopt;
    if (best_ < 2 || best_ + 2 >= gain_.size()) return std::nullopt;
    const double least_of_others = std::max(kLeastSigmasOfOthers, kLeastShareOfOthers * std::sqrt(gain_[best_]));
    if (sigmasOfOthers(noise) < least_of_others) return std::nullopt;
    return peakAt(best_);
  }

 private:
  using Series = std::vector<double>;

  std::size_t halfWidth() const { return std::max<std::size_t>(4, length_ / 48); }
  double fineStep_s() const { return step_s_ / kFiner; }
  double offset_s(std::size_t i) const { return (static_cast<double>(i) - static_cast<double>(zero_)) * fineStep_s(); }

  Spectrum spectrumOf(std::vector<double> values) const {
    values.resize(length_, 0.0);
    Eigen::FFT<double> fft;
    fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    Spectrum spectrum;
    fft.fwd(spectrum, values);
    return spectrum;
  }

  /// The inverse, each frequency by how exactly the path knows it; moved by `later_s`.
  Series whitened(Spectrum spectrum, const std::vector<double>& noise, double later_s) const {
    const double turn_rad = 2.0 * kPi / (static_cast<double>(length_) * step_s_) * later_s;
    spectrum[0] = 0.0;
    for (std::size_t k = 1; k < spectrum.size(); ++k) {
      spectrum[k] *= std::polar(1.0 / std::sqrt(noise[k]), -turn_rad * static_cast<double>(k));
    }
    Eigen::FFT<double> fft;
    fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    Series series;
    fft.inv(series, spectrum, static_cast<Eigen::Index>(length_));
    return series;
  }

  /// How much better the turns at the peak explain the path than none do, without the kOneTurn_s that say most.
  double sigmasOfOthers(const std::vector<double>& noise) const {
    const Series path = whitened(path_, noise, 0.0);
    const Series picture = whitened(picture_, noise, offset_s(best_));
    Series products{0.0};  // summed up
    Series squares{0.0};
    for (std::size_t k = 0; k < path.size(); ++k) {
      products.push_back(products.back() + path[k] * picture[k]);
      squares.push_back(squares.back() + picture[k] * picture[k]);
    }
    const double sign = std::copysign(1.0, products.back());
    const double all = sign * products.back() / std::sqrt(squares.back());
    const auto width = std::min(path.size(), static_cast<std::size_t>(std::ceil(std::max(kOneTurn_s / step_s_, 6.0))));
    double least = all;
    for (std::size_t k = 0; k + width <= path.size(); ++k) {
      const double product = products.back() - (products[k + width] - products[k]);
      const double square = squares.back() - (squares[k + width] - squares[k]);
      least = std::min(least, sign * product / std::sqrt(std::max(square, 1e-9 * squares.back())));
    }
    return std::sqrt(gain_[best_]) * least / all;
  }

  /// gain_: twice the log-likelihood that the pictures' turns add, by the offset; amplitude_: path over pictures.
  void correlate(const std::vector<double>& noise) {
    const std::size_t fine = kFiner * length_;
    Spectrum cross(fine / 2 + 1);
    double power = 0.0;
    for (std::size_t k = 1; k < path_.size(); ++k) {
      cross[k] = path_[k] * std::conj(picture_[k]) / noise[k];
      power += 2.0 * std::norm(picture_[k]) / noise[k];
    }
    Eigen::FFT<double> fft;
    fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    std::vector<double> correlation;
    fft.inv(correlation, cross, static_cast<Eigen::Index>(fine));
    zero_ = static_cast<std::size_t>(kClockReach_s / fineStep_s());
    gain_.assign(2 * zero_ + 1, 0.0);
    amplitude_.assign(2 * zero_ + 1, 0.0);
    const double redundancy = static_cast<double>(length_) / static_cast<double>(steps_);
    for (std::size_t i = 0; power > 0.0 && i < gain_.size(); ++i) {
      const double sum = correlation[(i + fine - zero_) % fine] * static_cast<double>(fine);
      amplitude_[i] = sum / power;
      gain_[i] = sum * sum / power / redundancy;
    }
    best_ = static_cast<std::size_t>(std::max_element(gain_.begin(), gain_.end()) - gain_.begin());
  }

  /// The path without what the pictures explain at the peak.
  Spectrum unexplained() const {
    Spectrum rest = path_;
    const double turn_rad = 2.0 * kPi / (static_cast<double>(length_) * step_s_) * offset_s(best_);
    for (std::size_t k = 0; k < rest.size(); ++k) {
      rest[k] -= amplitude_[best_] * std::polar(1.0, -turn_rad * static_cast<double>(k)) * picture_[k];
    }
    return rest;
  }

  /// By the parabola through the peak and what lies half a step beside it.
  ClockOffset peakAt(std::size_t i) const {
    const auto beside = std::clamp<std::size_t>(static_cast<std::size_t>(std::max(0.3, 0.5 * step_s_) / fineStep_s()),
                                                1, std::min(i, gain_.size() - 1 - i));
    const double before = gain_[i - beside];
    const double after = gain_[i + beside];
    const double bend = std::max(2.0 * gain_[i] - before - after, 1e-9);
    const double width_s = static_cast<double>(beside) * fineStep_s();
    ClockOffset found;
    found.offset_s = offset_s(i) + width_s * 0.5 * (after - before) / bend;
    found.sigma_s = width_s * std::sqrt(2.0 / bend);
    found.sigmas = std::sqrt(gain_[i]);
    found.at_zero_sigmas = std::sqrt(std::max(0.0, gain_[i] - gain_[zero_]));
    found.width_rad = amplitude_[i];
    return found;
  }

  double step_s_;
  std::size_t steps_;
  std::size_t length_ = 64;  ///< of the transforms, a power of two
  Spectrum path_;
  Spectrum picture_;
  std::vector<double> gain_;
  std::vector<double> amplitude_;
  std::size_t zero_ = 0;  ///< index of no offset
  std::size_t best_ = 0;
};

/// What the picture has moved since the first image.
Curve movedBy(const std::vector<PictureShift>& pictures, std::int64_t epoch_ns, Eigen::Index axis) {
  Curve moved{{secondsBetween(epoch_ns, pictures.front().from_ns)}, {0.0}};
  for (const PictureShift& picture : pictures) {
    moved.time_s.push_back(secondsBetween(epoch_ns, picture.to_ns));
    moved.value.push_back(moved.value.back() + picture.shift(axis));
  }
  return moved;
}

}  // namespace

std::optional<ClockOffset> clockOffset(const std::vector<PictureShift>& pictures,
                                       const std::vector<StampedPosition>& path) {
  if (pictures.size() < kFewestSteps || path.size() < kFewestSteps) return std::nullopt;
  const std::int64_t epoch_ns = path.front().stamp_ns;
  Curve east;
  Curve north;
  for (const StampedPosition& point : path) {
    east.time_s.push_back(secondsBetween(epoch_ns, point.stamp_ns));
    east.value.push_back(point.position_m.x());
    north.value.push_back(point.position_m.y());
  }
  north.time_s = east.time_s;
  const Curve right = movedBy(pictures, epoch_ns, 0);
  const auto turns = turnsOf(east, north, medianStep_s(right.time_s));
  if (!turns) return std::nullopt;
  std::optional<ClockOffset> best;
  for (const Eigen::Index axis : {0, 1}) {
    const std::optional<ClockOffset> found = TurnCorrelation(*turns, movedBy(pictures, epoch_ns, axis)).peak();
    if (!found || (best && found->sigmas <= best->sigmas)) continue;
    if (std::abs(found->width_rad) < kNarrowest_rad || std::abs(found->width_rad) > kWidest_rad) continue;
    best = found;
    best->along_rows = axis == 0;
  }
  return best;
}

}  // namespace visual_localization
