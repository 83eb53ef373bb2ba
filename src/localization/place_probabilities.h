#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace visual_localization {

/// How likely the robot is at each of many training images: those about which nothing was learnt have one probability
/// together, the others one of their own. Time and memory of most steps grow with the latter alone.
class PlaceProbabilities {
 public:
  struct Own {
    std::uint32_t training_image = 0;
    double probability = 0.0;
    double stayed = 0.0;      ///< of the probability, what the last motion did not move
    double likelihood = 0.0;  ///< of the last image
    std::uint32_t arrival = kNone;
  };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  /// Own probabilities that are kept at most; of more, the least probable become common.
  static constexpr std::size_t kMostOwn = 16384;

  explicit PlaceProbabilities(std::size_t training_images);
  /// The same of each.
  void reset(double probability);

  std::size_t size() const { return own_of_.size(); }
  double operator[](std::size_t training_image) const;
  /// From now on of its own.
  Own& own(std::size_t training_image);
  const std::vector<Own>& allOwn() const { return own_; }
  /// Changes each of the own ones, and what is common.
  template <class Change>
  void forEach(Change change) {
    for (Own& one : own_) change(one);
    change(common_);
  }
  /// What each of the others has; 0 where there is none.
  const Own& common() const { return common_; }
  std::size_t commonCount() const { return own_of_.size() - own_.size(); }
  /// Over all training images.
  template <class Value>
  double sum(Value value) const {
    double sum = commonCount() > 0 ? value(common_) * static_cast<double>(commonCount()) : 0.0;
    for (const Own& one : own_) sum += value(one);
    return sum;
  }
  bool isCommon(std::size_t training_image) const;

  /// The `count` most probable, at least as probable as `least`, the first of equals; not in order.
  void mostProbable(std::size_t count, double least, std::vector<std::size_t>& found) const;
  /// Training images at `first`, `first` + `step`, ... of the cumulated probability.
  std::vector<std::size_t> quantiles(double first, double step, std::size_t count) const;
  /// Makes common what is as probable as the others, to 1e-9 of that, and what exceeds kMostOwn. The sum stays.
  void joinAlike();

 private:
  Own common_;
  std::vector<Own> own_;
  std::vector<std::uint32_t> own_of_;  ///< of each training image; holds if own_ says so too
};

}  // namespace visual_localization
