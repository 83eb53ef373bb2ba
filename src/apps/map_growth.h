#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/bag_sessions.h"
#include "apps/command_line.h"
#include "editing/map_merger.h"
#include "editing/map_usage.h"

/// How maps grow.
namespace visual_localization::apps {

/// For MapHeader::history: what was done, from which files, by which program and version, and by whom: "merge of
/// north.map, south.map by map_edit 0.2.0, anna@workshop".
std::string provenance(const std::string& program, const std::string& command, const std::vector<std::string>& from);

/// A map whose images are read one by one. `of`: so many are open at a time. Throws MapStoreError, also for an image
/// that is damaged.
std::shared_ptr<const TrainingMap> openMap(const std::string& path, std::size_t of = 1);

/// Makes one map of these and says where each came to lie; see mergeMaps.
void mergeInto(const std::string& path, const std::vector<NamedMap>& maps, const std::string& edit,
               std::size_t threads);

/// Adds the recordings of `options.bags` to a map, as sessions. Says what became of them. `usage`: see addDrive; null:
/// no image is left out.
void addSessions(const NamedMap& map, const MapBuilderOptions& options, const MapUsage* usage,
                 const std::string& output, const std::string& edit);

/// Adds a drive to the map that it was localised in, by its verified poses instead of fixes, and leaves out what drives
/// use least; see summary(). `usage`: of this drive.
void addDrive(const NamedMap& map, const VerifiedDrive& drive, const MapBuilderOptions& options, const MapUsage& usage,
              const std::string& output, const std::string& edit);

}  // namespace visual_localization::apps
