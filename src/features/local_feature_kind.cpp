#include "visual_localization/features/local_feature_kind.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "base/text.h"
#include "visual_localization/features/learned.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

using Kinds = std::vector<std::shared_ptr<const LocalFeatureKind>>;

/// A line for each kind.
Kinds& registered() {
  static Kinds kinds{std::make_shared<Sift>(SiftConfig::uprightHellinger()), std::make_shared<Learned>()};
  return kinds;
}

template <class Pointers>
auto find(Pointers& kinds, const std::string& name) {
  return std::find_if(kinds.begin(), kinds.end(), [&name](const auto& kind) { return kind->name() == name; });
}

}  // namespace

ParameterValues LocalFeatureKind::parameters() const {
  const std::unique_ptr<LocalFeatureKind> copy = clone();
  return visual_localization::parameters::values([&copy](ParameterVisitor& visitor) { copy->declareStored(visitor); });
}

std::vector<std::uint8_t> LocalFeatureKind::pack(const LocalFeatures& features) const {
  if (form().element == DescriptorElement::kByte) return features.bytes();
  throw std::logic_error("local features '" + name() + "' do not say how they are stored");
}

void LocalFeatureKind::requireSize(std::size_t keypoints, std::size_t size) const {
  if (size == keypoints * stored_bytes()) return;
  throw std::runtime_error(std::to_string(keypoints) + " keypoints but " + std::to_string(size) +
                           " bytes of descriptors");
}

LocalFeatures LocalFeatureKind::unpack(Keypoints keypoints, const std::uint8_t* bytes, std::size_t size) const {
  requireSize(keypoints.size(), size);
  return LocalFeatures(std::move(keypoints), std::vector<std::uint8_t>(bytes, bytes + size));
}

std::vector<std::string> localFeatureNames() {
  std::vector<std::string> names;
  for (const auto& kind : registered()) names.push_back(kind->name());
  return names;
}

std::unique_ptr<LocalFeatureKind> makeLocalFeatureKind(const std::string& name) {
  const auto found = find(registered(), name);
  if (found != registered().end()) return (*found)->clone();
  throw std::invalid_argument("there are no local features '" + oneLine(name, 60) + "', only " +
                              joined(localFeatureNames()));
}

void registerLocalFeatureKind(std::shared_ptr<const LocalFeatureKind> kind) {
  const auto found = find(registered(), kind->name());
  if (found != registered().end()) {
    *found = std::move(kind);
  } else {
    registered().push_back(std::move(kind));
  }
}

LocalFeatureConfig::LocalFeatureConfig() {
  for (const auto& kind : registered()) kinds_.push_back(kind->clone());
}

LocalFeatureConfig::LocalFeatureConfig(const LocalFeatureConfig& other) : name_(other.name_) {
  for (const auto& kind : other.kinds_) kinds_.push_back(kind->clone());
}

LocalFeatureConfig& LocalFeatureConfig::operator=(const LocalFeatureConfig& other) {
  return *this = LocalFeatureConfig(other);
}

void LocalFeatureConfig::choose(const LocalFeatureKind& kind) {
  name_ = kind.name();
  const auto found = find(kinds_, name_);
  if (found != kinds_.end()) {
    *found = kind.clone();
  } else {
    kinds_.push_back(kind.clone());
  }
}

const LocalFeatureKind& LocalFeatureConfig::chosen() const { return **find(kinds_, name_); }

LocalFeatureKind& LocalFeatureConfig::chosen() { return **find(kinds_, name_); }

void LocalFeatureConfig::declare(ParameterVisitor& visitor) {
  std::vector<std::string> names;
  for (const auto& kind : kinds_) names.push_back(kind->name());
  visitor.choice({"map/features", "", "kind of local features"}, name_, names);
  for (const auto& kind : kinds_) kind->declare(visitor);
}

}  // namespace visual_localization
