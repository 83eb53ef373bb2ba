#include "localization/place_probabilities.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {

PlaceProbabilities::PlaceProbabilities(std::size_t training_images) : own_of_(training_images) {}

void PlaceProbabilities::reset(double probability) {
  own_.clear();
  common_ = Own();
  common_.probability = probability;
}

bool PlaceProbabilities::isCommon(std::size_t training_image) const {
  const std::uint32_t own = own_of_[training_image];
  return own >= own_.size() || own_[own].training_image != training_image;
}

double PlaceProbabilities::operator[](std::size_t training_image) const {
  return isCommon(training_image) ? common_.probability : own_[own_of_[training_image]].probability;
}

PlaceProbabilities::Own& PlaceProbabilities::own(std::size_t training_image) {
  if (isCommon(training_image)) {
    own_of_[training_image] = static_cast<std::uint32_t>(own_.size());
    own_.push_back(common_);
    own_.back().training_image = static_cast<std::uint32_t>(training_image);
  }
  return own_[own_of_[training_image]];
}

void PlaceProbabilities::mostProbable(std::size_t count, double least, std::vector<std::size_t>& found) const {
  found.clear();
  for (const Own& one : own_) {
    if (one.probability >= least) found.push_back(one.training_image);
  }
  std::size_t commons = common_.probability >= least ? std::min(count, commonCount()) : 0;
  for (std::size_t i = 0; commons > 0; ++i) {
    if (isCommon(i)) found.push_back(i), --commons;
  }
  if (found.size() <= count) return;
  std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), found.end(),
                   [this](std::size_t a, std::size_t b) {
                     const double of_a = (*this)[a];
                     const double of_b = (*this)[b];
                     return of_a != of_b ? of_a > of_b : a < b;
                   });
  found.resize(count);
}

std::vector<std::size_t> PlaceProbabilities::quantiles(double first, double step, std::size_t count) const {
  std::vector<std::uint32_t> in_order;
  for (const Own& one : own_) in_order.push_back(one.training_image);
  std::sort(in_order.begin(), in_order.end());
  std::vector<std::size_t> found;
  double target = first;
  double cumulated = 0.0;
  std::size_t next = 0;  // the training image at which `cumulated` ends
  for (std::size_t k = 0; k <= in_order.size() && found.size() < count; ++k) {
    const std::size_t end = k < in_order.size() ? in_order[k] : size();
    const double commons = common_.probability * static_cast<double>(end - next);
    for (; found.size() < count && target < cumulated + commons; target += step) {
      const auto among = static_cast<std::size_t>((target - cumulated) / common_.probability);
      found.push_back(std::min(next + among, end - 1));
    }
    cumulated += commons;
    next = end;
    if (k == in_order.size()) break;
    cumulated += (*this)[end];
    for (; found.size() < count && target < cumulated; target += step) found.push_back(end);
    ++next;
  }
  found.resize(count, size() - 1);  // rounding
  return found;
}

void PlaceProbabilities::joinAlike() {
  constexpr double kAlike = 1e-9;
  double sum = common_.probability * static_cast<double>(commonCount());
  auto count = static_cast<double>(commonCount());
  const auto join = [&](std::vector<Own>::iterator from) {
    for (auto one = from; one != own_.end(); ++one) sum += one->probability, count += 1.0;
    own_.erase(from, own_.end());
  };
  if (commonCount() > 0) {
    join(std::partition(own_.begin(), own_.end(), [this](const Own& one) {
      return std::abs(one.probability - common_.probability) > kAlike * common_.probability;
    }));
  }
  if (own_.size() > kMostOwn) {
    const auto last = own_.begin() + kMostOwn;
    std::nth_element(own_.begin(), last, own_.end(),
                     [](const Own& a, const Own& b) { return a.probability > b.probability; });
    join(last);
  }
  for (std::size_t i = 0; i < own_.size(); ++i) own_of_[own_[i].training_image] = static_cast<std::uint32_t>(i);
  common_.probability = count > 0.0 ? sum / count : 0.0;
}

}  // namespace visual_localization
