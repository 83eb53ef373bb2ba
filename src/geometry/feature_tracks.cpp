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

std::vector<FeatureTrack> cutTracks(const std::vector<FeatureTrack>& tracks, std::size_t max_views,
                                    const std::function<std::size_t(std::uint32_t image)>& session_of_image) {
  std::vector<FeatureTrack> cut;
  for (const FeatureTrack& track : tracks) {
    std::vector<FeatureTrack> by_session;
    for (std::size_t i = 0; i < track.size(); ++i) {
      const bool begins = i == 0 || session_of_image(track[i].image) != session_of_image(track[i - 1].image);
      if (begins) by_session.emplace_back();
      by_session.back().push_back(track[i]);
    }
    std::size_t longest = 0;
    for (const FeatureTrack& part : by_session) longest = std::max(longest, part.size());
    const std::size_t pieces = longest == 0 ? 0 : (longest - 1) / max_views + 1;
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      FeatureTrack& joined = cut.emplace_back();
      for (const FeatureTrack& part : by_session) {
        const auto at = [&](std::size_t k) {
          return part.begin() + static_cast<std::ptrdiff_t>(k * part.size() / pieces);
        };
        joined.insert(joined.end(), at(piece), at(piece + 1));
      }
    }
  }
  return cut;
}

}  // namespace visual_localization
