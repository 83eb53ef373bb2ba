#include "evaluation/topological_bayes_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/statistics.h"

namespace visual_localization {
namespace {

void normalise(std::vector<double>& masses) {
  const double sum = std::accumulate(masses.begin(), masses.end(), 0.0);
  for (double& mass : masses) mass /= sum;
}

}  // namespace

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
  // Logarithms, because every likelihood where the prediction is not zero may be too small for a double.
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

}  // namespace visual_localization
