#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/command_line.h"
#include "apps/map_export.h"
#include "editing/map_merger.h"
#include "editing/map_selection.h"
#include "visual_localization/geometry/image_geometry.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization::apps {

/// Calibration by images takes long: nothing moves on the screen meanwhile.
void announceCalibration(const MapBuildReport& report);
void printReport(const MapBuilderOptions& options, const MapBuildReport& report, const GeometryConfig& geometry,
                 const std::vector<PlottedSession>& sessions);
/// The map must be written.
void printSummary(const MapBuilderOptions& options, const MapBuildReport& report, double seconds);

/// Last, and yellow in a terminal: what of the recordings contradicts itself. The exit code stays 0.
void printDisagreements(const MapBuildReport& report, const std::vector<PlottedSession>& sessions);

/// Options take precedence over the file. Throws ParameterError or UsageError.
MapBuilderConfig readConfig(const MapBuilderOptions& options);

/// Throws UsageError when two of these are one file: two sessions would seem to see every position.
void requireDifferent(const std::string& what, const std::vector<std::string>& files);

/// Gives the builder fixes, camera, mount and images of the bag. Appends it to `sessions`, with a name that none of
/// them has. Throws BagError and whatever MapBuilder throws.
void addSession(MapBuilder& builder, const std::string& bag, const MapBuilderOptions& options,
                const MapBuilderConfig& config, std::vector<PlottedSession>& sessions);

/// Images whose poses landmarks verified, and these poses as fixes of the robot's origin.
struct VerifiedDrive {
  std::vector<Fix> poses;  ///< with the stamps of their images
  SessionCamera camera;    ///< as the drive was localised, with an antenna in the robot's origin
};

/// Without fixes in the bag. Other images than the verified ones are left out.
void addVerifiedSession(MapBuilder& builder, const std::string& bag, const VerifiedDrive& drive,
                        const MapBuilderOptions& options, std::vector<PlottedSession>& sessions);

/// For MapHeader::history: "merge of north.map, south.map by map_edit 0.2.0, anna@workshop".
std::string provenance(const std::string& program, const std::string& command, const std::vector<std::string>& from);

/// Reads images one by one; `of`: so many maps are open at a time. Throws MapStoreError, also for a damaged image.
std::shared_ptr<const TrainingMap> openMap(const std::string& path, std::size_t of = 1);

/// Says where each came to lie; see mergeMaps.
void mergeInto(const std::string& path, const std::vector<NamedMap>& maps, const std::string& edit,
               std::size_t threads);

/// Throws BagError when a session of the map is this recording.
void requireNewRecording(const std::string& bag, const std::string& image_topic, const NamedMap& map);

/// Adds `options.bags` as sessions and says what became of them. `usage`: see addDrive; null: no image is left out.
void addSessions(const NamedMap& map, const MapBuilderOptions& options, const MapUsage* usage,
                 const std::string& output, const std::string& edit);

/// By its verified poses instead of fixes; leaves out what drives use least, see summary(). `usage`: of this drive.
void addDrive(const NamedMap& map, const VerifiedDrive& drive, const MapBuilderOptions& options, const MapUsage& usage,
              const std::string& output, const std::string& edit);

}  // namespace visual_localization::apps
