#include "evaluation/place_recogniser.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/numbers.h"
#include "base/text.h"
#include "visual_localization/parameters/parameters.h"

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

/// Local contrast enhancement (Milford and Wyeth): how far the difference (1 - similarity) is from its mean along the
/// route nearby, in standard deviations. Without contrast 0.
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

void normalise(std::vector<double>& masses) {
  const double sum = std::accumulate(masses.begin(), masses.end(), 0.0);
  for (double& mass : masses) mass /= sum;
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

/// For the lines of this speed ending at every image at once.
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
  // No sample of N lies further below the mean than sqrt(N - 1) standard deviations; N is at most 2 radius + 1.
  const double least = -std::sqrt(2.0 * config_.normalisation_radius);
  constexpr double kRounding = 1e-9;
  if (std::isinf(rival) || rival < least + kRounding) return 0.0;
  return std::min(1.0, (rival - scores_[best]) / (rival - least));
}

void TopologicalBayesConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"bayes/min_step", "1", "training images moved per image at least; negative is backwards (w_l)"},
                  min_step, -10000, 0);
  visitor.integer({"bayes/max_step", "1", "training images moved per image at most (w_u)"}, max_step, 0, 10000);
  visitor.real({"bayes/reset", "1", "probability that the robot is anywhere after an image"}, reset, 0.0, 1.0);
  visitor.real({"bayes/delta", "1", "likelihood ratio between very similar and very different training images"}, delta,
               1.0, 1e6);
  visitor.integer({"bayes/window", "1", "training images that count as one place, an odd number"}, window, 1, 99999);
  visitor.require(window % 2 != 0, "bayes/window", std::to_string(window),
                  "odd: as many training images before as after the middle one");
}

TopologicalBayesFilter::TopologicalBayesFilter(const TopologicalBayesConfig& config, bool closed)
    : config_(config), closed_(closed), route_(0, closed) {}

Recognition TopologicalBayesFilter::update(const std::vector<double>& similarities) {
  requireRow(similarities, route_.size());
  route_ = Route(similarities.size(), closed_);
  predict();
  weigh(similarities);
  return mostProbablePlace();
}

void TopologicalBayesFilter::predict() {
  const auto images = static_cast<double>(route_.size());
  if (posterior_.empty()) {
    posterior_.assign(route_.size(), 1.0 / images);
    return;
  }
  buffer_.assign(route_.size(), config_.reset / images);
  for (std::size_t from = 0; from < route_.size(); ++from) {
    int possible = 0;
    for (int step = config_.min_step; step <= config_.max_step; ++step) possible += route_.at(from, step) ? 1 : 0;
    const double share = (1.0 - config_.reset) * posterior_[from] / possible;
    for (int step = config_.min_step; step <= config_.max_step; ++step) {
      if (const auto to = route_.at(from, step)) buffer_[*to] += share;
    }
  }
  posterior_.swap(buffer_);
}

void TopologicalBayesFilter::calibrate(const std::vector<double>& similarities) {
  constexpr double kTail = 0.025;
  buffer_ = similarities;  // differences are as far apart as similarities
  std::sort(buffer_.begin(), buffer_.end());
  double range = quantile(buffer_, 1.0 - kTail) - quantile(buffer_, kTail);
  if (range <= 0.0) range = buffer_.back() - buffer_.front();
  if (range > 0.0) lambda_ = std::log(config_.delta) / range;
}

void TopologicalBayesFilter::weigh(const std::vector<double>& similarities) {
  if (lambda_ == 0.0) calibrate(similarities);
  // Logarithms: every likelihood may be too small for a double.
  for (std::size_t image = 0; image < posterior_.size(); ++image) {
    posterior_[image] = std::log(posterior_[image]) - lambda_ * (1.0 - similarities[image]);
  }
  const double largest = *std::max_element(posterior_.begin(), posterior_.end());
  for (double& mass : posterior_) mass = std::exp(mass - largest);
  normalise(posterior_);
}

double TopologicalBayesFilter::massAround(std::size_t image) const {
  double mass = 0.0;
  route_.forEachWithin(static_cast<std::size_t>(config_.window / 2), image,
                       [&](std::size_t neighbour) { mass += posterior_[neighbour]; });
  return mass;
}

Recognition TopologicalBayesFilter::mostProbablePlace() const {
  std::size_t middle = 0;
  double most = -1.0;
  for (std::size_t image = 0; image < posterior_.size(); ++image) {
    const double mass = massAround(image);
    if (mass > most) middle = image, most = mass;
  }
  std::size_t best = middle;
  route_.forEachWithin(static_cast<std::size_t>(config_.window / 2), middle, [&](std::size_t neighbour) {
    if (posterior_[neighbour] > posterior_[best]) best = neighbour;
  });
  return {best, massAround(best)};
}

std::optional<std::size_t> Route::at(std::size_t from, std::ptrdiff_t steps) const {
  const auto images = static_cast<std::ptrdiff_t>(images_);
  const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(from) + steps;
  if (to >= 0 && to < images) return static_cast<std::size_t>(to);
  if (!closed_) return std::nullopt;
  return static_cast<std::size_t>((to % images + images) % images);
}

std::size_t Route::distance(std::size_t a, std::size_t b) const {
  const std::size_t direct = a > b ? a - b : b - a;
  return closed_ ? std::min(direct, images_ - direct) : direct;
}

void requireRow(const std::vector<double>& similarities, std::size_t training_images) {
  constexpr double kMax = 1.0 + 1e-9;  // histograms that sum to one do so but for rounding
  if (similarities.empty()) throw std::invalid_argument("similarities to no training image at all");
  if (training_images != 0 && similarities.size() != training_images) {
    throw std::invalid_argument("similarities to " + std::to_string(similarities.size()) +
                                " training images after similarities to " + std::to_string(training_images));
  }
  for (std::size_t image = 0; image < similarities.size(); ++image) {
    if (similarities[image] >= 0.0 && similarities[image] <= kMax) continue;
    throw std::invalid_argument("similarity " + std::to_string(similarities[image]) + " to training image " +
                                std::to_string(image) + " is not in [0, 1]");
  }
}

Recognition BestSingleImage::update(const std::vector<double>& similarities) {
  requireRow(similarities, training_images_);
  training_images_ = similarities.size();
  const auto best = std::max_element(similarities.begin(), similarities.end());
  return {static_cast<std::size_t>(best - similarities.begin()), *best};
}

void PlaceRecogniserConfig::declare(ParameterVisitor& visitor) {
  sequence.declare(visitor);
  bayes.declare(visitor);
}

const std::vector<std::string>& placeRecogniserNames() {
  static const std::vector<std::string> kNames = {"exhaustive", "sequence", "topological"};
  return kNames;
}

std::unique_ptr<PlaceRecogniser> makePlaceRecogniser(const std::string& name, const PlaceRecogniserConfig& config,
                                                     bool closed) {
  const std::vector<std::string> wrong = violationsOf(config);
  if (!wrong.empty()) throw std::invalid_argument(wrong.front());
  if (name == "exhaustive") return std::make_unique<BestSingleImage>();
  if (name == "sequence") return std::make_unique<SequenceMatcher>(config.sequence, closed);
  if (name == "topological") return std::make_unique<TopologicalBayesFilter>(config.bayes, closed);
  throw std::invalid_argument("place recogniser '" + name + "' is unknown; known are " +
                              joined(placeRecogniserNames()));
}

}  // namespace visual_localization
