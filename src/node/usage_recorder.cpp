#include "node/usage_recorder.h"

#include <cstddef>
#include <filesystem>
#include <utility>

#include "base/text.h"

namespace visual_localization {
namespace {

constexpr std::chrono::seconds kSavePeriod{60};
constexpr std::size_t kLargestUsage_bytes = std::size_t{256} << 20U;

MapUsage readUsage(const std::string& path) {
  const PartialFile attempt(path);  // what cannot be written is said now
  if (!std::filesystem::exists(path)) return {};
  try {
    return MapUsage::fromCsv(readFile(path, kLargestUsage_bytes));
  } catch (const UsageFileError& error) {
    throw UsageFileError(oneLine(path) + ": " + error.what());
  }
}

}  // namespace

void writeUsage(const std::string& path, const MapUsage& usage) {
  PartialFile file(path);
  file.write(usage.toCsv());
  file.commit();
}

UsageRecorder::UsageRecorder(std::string path, ThrottledLog& log)
    : path_(std::move(path)), log_(log), lock_(path_), usage_(readUsage(path_)) {}

UsageRecorder::~UsageRecorder() {
  if (saving_.valid()) saving_.wait();
  if (changed_) save();
}

void UsageRecorder::publish(const LocalizedImage& image, const ImageCounts&) {
  const SharedLocalizer::Result& result = image.result;
  if (result.estimate.source != PoseSource::kMetric || result.estimate.repeats > 0) return;
  usage_.add(*result.map, result.landmarks);
  changed_ = true;
  if (std::chrono::steady_clock::now() - saved_ >= kSavePeriod) save();
}

void UsageRecorder::save() {
  saved_ = std::chrono::steady_clock::now();
  changed_ = false;
  saving_ = std::async(std::launch::async, [this, usage = usage_] {
    try {
      writeUsage(path_, usage);
    } catch (const FileError& error) {
      log_.error("usage", std::string("Usage of the map is not saved: ") + error.what());
    }
  });
}

}  // namespace visual_localization
