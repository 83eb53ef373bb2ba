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

/// How recordings become sessions of a map, how maps grow, and what the programs say of it.
namespace visual_localization::apps {

/// Which sessions will be calibrated by their images: nothing moves on the screen meanwhile.
void announceCalibration(const MapBuildReport& report);
/// What was kept of each session, and why the rest was dropped.
void printReport(const MapBuilderOptions& options, const MapBuildReport& report, const GeometryConfig& geometry,
                 const std::vector<PlottedSession>& sessions);
/// In one line. The map must be written.
void printSummary(const MapBuilderOptions& options, const MapBuildReport& report, double seconds);

/// Last, and yellow in a terminal: what of the recordings contradicts itself. A map is written all the same, and the
/// exit code is 0. Nothing when all agrees.
void printDisagreements(const MapBuildReport& report, const std::vector<PlottedSession>& sessions);

/// The parameters of a file, if there is one, and what the options say otherwise. Throws ParameterError or UsageError.
MapBuilderConfig readConfig(const MapBuilderOptions& options);

/// Throws UsageError when two of these are one file: the map would be twice as large and show nothing more, while two
/// sessions seemed to see every position.
void requireDifferent(const std::string& what, const std::vector<std::string>& files);

/// Gives the builder what the bag has: fixes, camera, mount and images. Appends it to `sessions`, with a name that none
/// of them has. Throws BagError and whatever MapBuilder throws.
void addSession(MapBuilder& builder, const std::string& bag, const MapBuilderOptions& options,
                const MapBuilderConfig& config, std::vector<PlottedSession>& sessions);

/// The images of a drive whose poses landmarks verified, and these poses as fixes of the robot's origin.
struct VerifiedDrive {
  std::vector<Fix> poses;  ///< with the stamps of their images
  SessionCamera camera;    ///< as the drive was localised, with an antenna in the robot's origin
};

/// The same as addSession() of a drive, which needs no fixes. Other images than those that were verified are left out.
void addVerifiedSession(MapBuilder& builder, const std::string& bag, const VerifiedDrive& drive,
                        const MapBuilderOptions& options, std::vector<PlottedSession>& sessions);

/// For MapHeader::history: what was done, from which files, by which program and version, and by whom: "merge of
/// north.map, south.map by map_edit 0.2.0, anna@workshop".
std::string provenance(const std::string& program, const std::string& command, const std::vector<std::string>& from);

/// A map whose images are read one by one. `of`: so many are open at a time. Throws MapStoreError, also for an image
/// that is damaged.
std::shared_ptr<const TrainingMap> openMap(const std::string& path, std::size_t of = 1);

/// Makes one map of these and says where each came to lie; see mergeMaps.
void mergeInto(const std::string& path, const std::vector<NamedMap>& maps, const std::string& edit,
               std::size_t threads);

/// Throws BagError when a session of the map is this recording: before the work, where merging would find it after.
void requireNewRecording(const std::string& bag, const std::string& image_topic, const NamedMap& map);

/// Adds the recordings of `options.bags` to a map, as sessions. Says what became of them. `usage`: see addDrive; null:
/// no image is left out.
void addSessions(const NamedMap& map, const MapBuilderOptions& options, const MapUsage* usage,
                 const std::string& output, const std::string& edit);

/// Adds a drive to the map that it was localised in, by its verified poses instead of fixes, and leaves out what drives
/// use least; see summary(). `usage`: of this drive.
void addDrive(const NamedMap& map, const VerifiedDrive& drive, const MapBuilderOptions& options, const MapUsage& usage,
              const std::string& output, const std::string& edit);

}  // namespace visual_localization::apps
