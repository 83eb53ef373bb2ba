#include "visual_localization/map/feature_store.h"

#include <utility>

namespace visual_localization {
namespace {

/// A pointer that owns nothing, for what lives as long as the store: no count that threads would contend for.
template <class T>
std::shared_ptr<const T> unowned(const T& value) {
  return {std::shared_ptr<const T>(), &value};
}

}  // namespace

MemoryFeatureStore::MemoryFeatureStore(std::vector<TrainingImage>&& images) {
  sift_.reserve(images.size());
  global_.reserve(images.size());
  previews_.reserve(images.size());
  for (TrainingImage& image : images) {
    sift_.push_back(std::move(image.sift));
    global_.push_back(image.global);
    previews_.push_back(std::move(image.preview_jpeg));
  }
}

std::shared_ptr<const SiftFeatures> MemoryFeatureStore::sift(std::size_t image) const { return unowned(sift_[image]); }

std::shared_ptr<const GlobalFeatures> MemoryFeatureStore::global(std::size_t image) const {
  return unowned(global_[image]);
}

}  // namespace visual_localization
