#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "visual_localization/base/progress.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// An edit that makes no sense. The text is one line.
class MapEditError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Those images of `map`, opened with strictLoading(), that `keep` has, as a map file; sessions without images go.
/// `edit`: for MapHeader::history; empty: nothing. `change`: what else becomes of an image. Throws MapStoreError, and
/// MapEditError when no image is left.
void writeSelection(const TrainingMap& map, const std::vector<bool>& keep, const std::string& edit,
                    const std::string& path, const Progress& progress = {},
                    const std::function<void(TrainingImage&)>& change = {});

/// All images but those of the session of this name. Throws MapEditError, with the names that there are.
std::vector<bool> withoutSession(const TrainingMap& map, const std::string& name);

/// Images that are at least this far from the one kept before, session by session.
std::vector<bool> spaced(const TrainingMap& map, double spacing_m);

}  // namespace visual_localization
