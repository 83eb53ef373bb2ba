#pragma once

#include <chrono>
#include <future>
#include <string>

#include "base/files.h"
#include "editing/map_usage.h"
#include "node/image_worker.h"
#include "node/throttled_log.h"

namespace visual_localization {

/// Counts what metric poses rest on, in a file beside the map, for map_edit. Saves it every minute and at its end, in a
/// thread of its own.
class UsageRecorder : public ImageOutput {
 public:
  /// Goes on from what the file has. Throws UsageFileError or FileError naming it, also when another process writes it.
  UsageRecorder(std::string path, ThrottledLog& log);
  ~UsageRecorder() override;

  void publish(const LocalizedImage& image, const ImageCounts& counts) override;

 private:
  void save();

  const std::string path_;
  ThrottledLog& log_;
  OutputLock lock_;
  MapUsage usage_;
  bool changed_ = false;
  std::chrono::steady_clock::time_point saved_ = std::chrono::steady_clock::now();
  std::future<void> saving_;
};

/// Writes a file of use. Throws FileError.
void writeUsage(const std::string& path, const MapUsage& usage);

}  // namespace visual_localization
