#include "geometry/feature_tracks.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace visual_localization {
namespace {

/// Disjoint sets of features, numbered over all images.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0U); }

  std::uint32_t root(std::uint32_t i) {
    while (parents_[i] != i) {
      parents_[i] = parents_[parents_[i]];
      i = parents_[i];
    }
    return i;
  }
  /// The smaller number becomes the root, so that the result does not depend on the order of the pairs.
  void join(std::uint32_t a, std::uint32_t b) {
    const auto [small, large] = std::minmax({root(a), root(b)});
    parents_[large] = small;
  }

 private:
  std::vector<std::uint32_t> parents_;
};

bool showsAnImageTwice(const FeatureTrack& track) {
  return std::adjacent_find(track.begin(), track.end(), [](const auto& left, const auto& right) {
           return left.image == right.image;
         }) != track.end();
}

}  // namespace

std::vector<FeatureTrack> tracksOf(const std::vector<ImagePair>& pairs, const std::vector<std::size_t>& feature_counts,
                                   std::size_t min_views) {
  std::vector<std::uint32_t> first(feature_counts.size() + 1, 0);
  for (std::size_t i = 0; i < feature_counts.size(); ++i) {
    first[i + 1] = first[i] + static_cast<std::uint32_t>(feature_counts[i]);
  }
  DisjointSets sets(first.back());
  for (const ImagePair& pair : pairs) {
    for (const FeatureMatch& match : pair.matches) {
      sets.join(first[pair.a] + static_cast<std::uint32_t>(match.a),
                first[pair.b] + static_cast<std::uint32_t>(match.b));
    }
  }
  std::vector<FeatureTrack> by_root(first.back());
  for (std::uint32_t image = 0; image < feature_counts.size(); ++image) {
    for (std::uint32_t feature = 0; feature < feature_counts[image]; ++feature) {
      by_root[sets.root(first[image] + feature)].push_back({image, feature});
    }
  }
  std::vector<FeatureTrack> tracks;
  for (FeatureTrack& track : by_root) {
    if (track.size() >= min_views && !showsAnImageTwice(track)) tracks.push_back(std::move(track));
  }
  return tracks;
}

}  // namespace visual_localization
