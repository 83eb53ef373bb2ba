#include "evaluation/sequence_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "evaluation/place_recogniser.h"

namespace visual_localization {
namespace {

/// For every speed the way back along the route: how far the line is behind its end, so many images ago.
std::vector<std::vector<std::ptrdiff_t>> straightLines(const SequenceConfig& config) {
  constexpr double kRounding = 1e-9;  // 0.8 + 4 * 0.1 is not quite 1.2
  std::vector<std::vector<std::ptrdiff_t>> lines;
  const auto steps = static_cast<int>((config.max_speed - config.min_speed) / config.speed_step + kRounding);
  for (int step = 0; step <= steps; ++step) {
    const double speed = config.min_speed + step * config.speed_step;
    auto& line = lines.emplace_back();
    for (int ago = 0; ago < config.length; ++ago) line.push_back(std::lround(speed * ago));
  }
  return lines;
}

/// How far the difference (1 - similarity) is from its mean along the route nearby, in standard deviations: the local
/// contrast enhancement of Milford and Wyeth. Without contrast 0, which says nothing.
double localContrast(const std::vector<double>& similarities, const Route& route, const SequenceConfig& config,
                     std::size_t image) {
  double count = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  route.forEachWithin(static_cast<std::size_t>(config.normalisation_radius), image, [&](std::size_t neighbour) {
    const double relative = similarities[neighbour] - similarities[image];
    count += 1.0;
    sum += relative;
    squares += relative * relative;
  });
  const double mean = sum / count;
  const double deviation = std::sqrt(std::max(0.0, squares / count - mean * mean));
  return mean / std::max(deviation, config.min_contrast);
}

}  // namespace

void SequenceConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"sequence/length", "1", "how many of the last images are matched together (d_s)"}, length, 1, 10000);
  visitor.integer({"sequence/normalisation_radius", "1",
                   "training images to each side that contrast is normalised over (R_window)"},
                  normalisation_radius, 1, 100000);
  visitor.real({"sequence/min_contrast", "1",
                "smaller standard deviations of similarity are noise: raised to this to normalise"},
               min_contrast, 1e-6, 1.0);
  visitor.real({"sequence/min_speed", "1", "slowest drive, in training images per image (V_min)"}, min_speed, 0.0,
               100.0);
  visitor.real({"sequence/max_speed", "1", "fastest drive, in training images per image (V_max)"}, max_speed, 0.0,
               100.0);
  visitor.real({"sequence/speed_step", "1", "between the speeds that are tried (V_step)"}, speed_step, 0.01, 100.0);
  visitor.integer({"sequence/uniqueness_radius", "1", "training images this close to the best one are no rivals of it"},
                  uniqueness_radius, 0, 100000);
  visitor.atMost("sequence/min_speed", min_speed, "sequence/max_speed", max_speed);
}

SequenceMatcher::SequenceMatcher(const SequenceConfig& config, bool closed)
    : config_(config), closed_(closed), lines_(straightLines(config)), route_(0, closed) {}

Recognition SequenceMatcher::update(const std::vector<double>& similarities) {
  requireRow(similarities, route_.size());
  route_ = Route(similarities.size(), closed_);
  remember(similarities);
  scoreLines();
  const auto best = static_cast<std::size_t>(std::min_element(scores_.begin(), scores_.end()) - scores_.begin());
  return {best, confidence(best)};
}

void SequenceMatcher::remember(const std::vector<double>& similarities) {
  std::vector<double> column;
  if (columns_.size() == static_cast<std::size_t>(config_.length)) {
    column = std::move(columns_.front());  // saves the allocation
    columns_.pop_front();
  }
  column.resize(similarities.size());
  for (std::size_t image = 0; image < column.size(); ++image) {
    column[image] = localContrast(similarities, route_, config_, image);
  }
  columns_.push_back(std::move(column));
}

/// Adds the differences along one line to `sums`, for the lines of this speed ending at every image at once.
void SequenceMatcher::addLines(const std::vector<std::ptrdiff_t>& line, std::vector<double>& sums) const {
  const std::size_t images = route_.size();
  for (std::size_t ago = 0; ago < columns_.size(); ++ago) {
    const std::vector<double>& column = columns_[columns_.size() - 1 - ago];
    const auto back = static_cast<std::size_t>(line[ago]);
    const std::size_t behind = closed_ ? back % images : std::min(back, images);
    for (std::size_t end = behind; end < images; ++end) sums[end] += column[end - behind];
    if (!closed_) continue;  // lines that begin before an open route are no different from the average there
    for (std::size_t end = 0; end < behind; ++end) sums[end] += column[end + images - behind];
  }
}

/// Mean difference along the best line ending at each image.
void SequenceMatcher::scoreLines() {
  scores_.assign(route_.size(), std::numeric_limits<double>::infinity());
  for (const auto& line : lines_) {
    sums_.assign(route_.size(), 0.0);
    addLines(line, sums_);
    for (std::size_t end = 0; end < scores_.size(); ++end) scores_[end] = std::min(scores_[end], sums_[end]);
  }
  for (double& score : scores_) score /= static_cast<double>(columns_.size());
}

double SequenceMatcher::confidence(std::size_t best) const {
  double rival = std::numeric_limits<double>::infinity();
  for (std::size_t image = 0; image < route_.size(); ++image) {
    if (route_.distance(image, best) <= static_cast<std::size_t>(config_.uniqueness_radius)) continue;
    rival = std::min(rival, scores_[image]);
  }
  // No sample of N lies further below their mean than sqrt(N - 1) standard deviations, and N is at most 2 radius + 1.
  const double least = -std::sqrt(2.0 * config_.normalisation_radius);
  constexpr double kRounding = 1e-9;
  if (std::isinf(rival) || rival < least + kRounding) return 0.0;
  return std::min(1.0, (rival - scores_[best]) / (rival - least));
}

}  // namespace visual_localization
