#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// What the images of a map looked like: all of it in memory, or read from the map's file when it is first needed.
/// For several threads at once. What it hands out stays valid as long as the pointer to it and the store live.
class FeatureStore {
 public:
  virtual ~FeatureStore() = default;
  /// SIFT features of a training image, after pruning; never null. `image` is below the size of the map.
  virtual std::shared_ptr<const SiftFeatures> sift(std::size_t image) const = 0;
  /// Global features of a training image; never null.
  virtual std::shared_ptr<const GlobalFeatures> global(std::size_t image) const = 0;
  /// Small grey JPEG for people; may be empty.
  virtual std::vector<std::uint8_t> preview(std::size_t image) const = 0;
  /// How many images' global features can be in memory at a time, with room for SIFT features beside them; more than
  /// any map has when all of them are.
  virtual std::size_t globalsKept() const = 0;
};

/// Everything in memory: nothing is locked, counted or copied.
class MemoryFeatureStore final : public FeatureStore {
 public:
  /// Takes what the images looked like; of `images` is left where they were taken.
  explicit MemoryFeatureStore(std::vector<TrainingImage>&& images);

  std::shared_ptr<const SiftFeatures> sift(std::size_t image) const override;
  std::shared_ptr<const GlobalFeatures> global(std::size_t image) const override;
  std::vector<std::uint8_t> preview(std::size_t image) const override { return previews_[image]; }
  std::size_t globalsKept() const override { return std::numeric_limits<std::size_t>::max(); }

 private:
  std::vector<SiftFeatures> sift_;
  std::vector<GlobalFeatures> global_;
  std::vector<std::vector<std::uint8_t>> previews_;
};

}  // namespace visual_localization
