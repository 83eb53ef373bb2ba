#include "visual_localization/features/sift_matcher.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace visual_localization {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// The two most similar candidates seen so far; the first of equals stays.
struct TwoNearest {
  float best = -1.0F;
  float second = -1.0F;
  std::size_t index = kNone;

  void offer(float cosine, std::size_t candidate) {
    if (cosine > best) {
      second = best;
      best = cosine;
      index = candidate;
    } else if (cosine > second) {
      second = cosine;
    }
  }

  /// Ratio of the angles to the nearest and the second nearest, as in Lowe's matcher.
  bool distinct(double max_angle_ratio) const {
    const double nearest = std::acos(std::min(1.0, static_cast<double>(best)));
    const double next = std::acos(std::min(1.0, static_cast<double>(second)));
    return nearest < max_angle_ratio * next;
  }
};

/// Descriptors as 16-bit numbers: compilers turn their scalar product into one multiply-add instruction for eight
/// bins (pmaddwd), which they do not for bytes.
std::vector<std::int16_t> widened(const SiftFeatures& features) {
  return std::vector<std::int16_t>(features.descriptors().begin(), features.descriptors().end());
}

std::int32_t dot(const std::int16_t* a, const std::int16_t* b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < SiftFeatures::kDescriptorSize; ++i) sum += std::int32_t{a[i]} * std::int32_t{b[i]};
  return sum;
}

/// Descriptors ready for comparison.
struct Prepared {
  explicit Prepared(const SiftFeatures& features) : bins(widened(features)), inverse_norms(features.size()) {
    for (std::size_t i = 0; i < inverse_norms.size(); ++i) {
      const auto squared = static_cast<float>(dot(row(i), row(i)));
      // The zero vector is orthogonal to everything.
      inverse_norms[i] = squared > 0.0F ? 1.0F / std::sqrt(squared) : 0.0F;
    }
  }
  const std::int16_t* row(std::size_t i) const { return bins.data() + i * SiftFeatures::kDescriptorSize; }

  std::vector<std::int16_t> bins;
  std::vector<float> inverse_norms;
};

struct Nearest {
  std::vector<TwoNearest> of_a;  ///< in B
  std::vector<TwoNearest> of_b;  ///< in A
};

Nearest findNearest(const SiftFeatures& features_a, const SiftFeatures& features_b) {
  const Prepared a(features_a);
  const Prepared b(features_b);
  Nearest nearest{std::vector<TwoNearest>(features_a.size()), std::vector<TwoNearest>(features_b.size())};
  for (std::size_t i = 0; i < nearest.of_a.size(); ++i) {
    for (std::size_t j = 0; j < nearest.of_b.size(); ++j) {
      const float cosine = static_cast<float>(dot(a.row(i), b.row(j))) * a.inverse_norms[i] * b.inverse_norms[j];
      nearest.of_a[i].offer(cosine, j);
      nearest.of_b[j].offer(cosine, i);
    }
  }
  return nearest;
}

}  // namespace

void MatchConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"match/max_angle_ratio", "1", "largest ratio of the angles to the nearest and second nearest (delta)"},
               max_angle_ratio, 0.1, 1.0);
  visitor.choice({"match/mode", "", "symmetric: both directions must agree (journal); one_way: test in training only"},
                 mode, {"symmetric", "one_way"});
}

std::vector<FeatureMatch> matchOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio) {
  if (a.size() < 2 || b.size() < 2) return {};
  const Nearest nearest = findNearest(a, b);
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (nearest.of_a[i].distinct(max_angle_ratio)) matches.push_back({i, nearest.of_a[i].index});
  }
  return matches;
}

std::vector<FeatureMatch> matchSymmetric(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio) {
  if (a.size() < 2 || b.size() < 2) return {};
  const Nearest nearest = findNearest(a, b);
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t j = nearest.of_a[i].index;
    if (nearest.of_b[j].index == i && nearest.of_a[i].distinct(max_angle_ratio) &&
        nearest.of_b[j].distinct(max_angle_ratio)) {
      matches.push_back({i, j});
    }
  }
  return matches;
}

}  // namespace visual_localization
