#include "geometry/session_alignment.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <unordered_map>

#include "base/statistics.h"
#include "geometry/vectors.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLeastShared = 8;  ///< landmarks of both that say where one is beside the other
constexpr std::size_t kWindow = 10;      ///< images on each side whose ties count for an image

/// What a tie says about the session of an image.
struct Offset {
  std::size_t image;  ///< within its session
  Eigen::Vector3d shift_m;
};

/// Landmarks by what shows them. The reconstruction must keep its landmarks meanwhile; they may move.
class SeenLandmarks {
 public:
  explicit SeenLandmarks(const Reconstruction& reconstruction) {
    for (const Landmark& landmark : reconstruction.landmarks()) {
      for (const LandmarkSighting& sighting : landmark.sightings) {
        positions_[key(sighting.image, sighting.feature)] = &landmark.position_m;
      }
    }
  }

  /// From the landmarks of image b to those of image a: the median over their matches.
  std::optional<Eigen::Vector3d> offset(const ImagePair& pair) const {
    std::vector<Eigen::Vector3d> differences;
    for (const FeatureMatch& match : pair.matches) {
      const auto a = positions_.find(key(pair.a, static_cast<std::uint32_t>(match.a)));
      const auto b = positions_.find(key(pair.b, static_cast<std::uint32_t>(match.b)));
      if (a != positions_.end() && b != positions_.end()) differences.push_back(*a->second - *b->second);
    }
    if (differences.size() < kLeastShared) return std::nullopt;
    return medianOf(differences);
  }

 private:
  static std::uint64_t key(std::uint32_t image, std::uint32_t feature) {
    return (static_cast<std::uint64_t>(image) << 32U) | feature;
  }

  std::unordered_map<std::uint64_t, const Eigen::Vector3d*> positions_;
};

/// The median of the ties near each image, or of the nearest one. `offsets`: in order of the image, one at least.
std::vector<Eigen::Vector3d> shiftsAlong(std::size_t images, const std::vector<Offset>& offsets) {
  std::vector<Eigen::Vector3d> shifts_m;
  for (std::size_t i = 0; i < images; ++i) {
    std::vector<Eigen::Vector3d> near;
    const Offset* nearest = &offsets.front();
    const auto apart = [i](const Offset& offset) { return offset.image > i ? offset.image - i : i - offset.image; };
    for (const Offset& offset : offsets) {
      if (apart(offset) <= kWindow) near.push_back(offset.shift_m);
      if (apart(offset) < apart(*nearest)) nearest = &offset;
    }
    shifts_m.push_back(near.empty() ? nearest->shift_m : medianOf(near));
  }
  return shifts_m;
}

}  // namespace

std::vector<double> alignSessions(const std::vector<ImagePair>& ties, Reconstruction& reconstruction) {
  const SeenLandmarks landmarks(reconstruction);  // moves with them
  std::vector<double> apart_m(reconstruction.sessions(), 0.0);
  for (std::size_t session = 1; session < apart_m.size(); ++session) {
    const std::size_t begin = reconstruction.begin(session);
    std::vector<Offset> offsets;
    std::vector<double> lengths_m;
    for (const ImagePair& tie : ties) {
      if (reconstruction.sessionOf(tie.b) != session) continue;
      const auto shift_m = landmarks.offset(tie);
      if (!shift_m) continue;
      offsets.push_back({tie.b - begin, *shift_m});
      lengths_m.push_back(shift_m->norm());
    }
    if (offsets.empty()) continue;
    apart_m[session] = median(lengths_m);
    reconstruction.move(session, shiftsAlong(reconstruction.imagesIn(session), offsets));
  }
  return apart_m;
}

}  // namespace visual_localization
