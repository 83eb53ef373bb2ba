#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/spinner.h>
#include <visual_localization/RecordSession.h>

#include "bag/bag_writer.h"
#include "base/files.h"
#include "base/process.h"
#include "editing/map_selection.h"
#include "node/image_worker.h"
#include "node/throttled_log.h"

namespace visual_localization {

/// Counts what metric poses rest on, in a file for map_edit: every minute and at its end, in a thread of its own.
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

/// What a recorded session adds to a map.
struct SessionExtension {
  std::string map;
  std::string bag;
  std::string image_topic;
  std::string fix_topic;
  std::string mask;   ///< of the camera; empty: none
  std::string usage;  ///< of the map, by the same drive
  std::string output;
};

/// ~record_session: records images with verified poses, with these poses as fixes, and writes the map with them as a
/// new session. In a thread of its own; what is older than five seconds is whole on the disk (see BagWriter).
class SessionRecorder : public ImageOutput {
 public:
  /// By `map_edit`, which ends with this object; throws std::exception in one line.
  using Extend = std::function<void(const SessionExtension& extension, ChildProcess& map_edit)>;

  /// `folder`: an absolute path; empty: every call is refused.
  SessionRecorder(std::string folder, Extend extend, ThrottledLog& log);
  ~SessionRecorder() override;

  /// In a thread of its own.
  void offer(ros::NodeHandle private_node);
  /// A session that is being recorded goes on to extend its own map, with images that are localised in that one.
  void mapIs(const std::string& path, std::shared_ptr<const TrainingMap> map);

  void publish(const LocalizedImage& image, const ImageCounts& counts) override;

 private:
  struct Session {
    std::string map_path;
    std::shared_ptr<const TrainingMap> map;
    std::unique_ptr<BagWriter> bag;
    MapUsage usage;
    bool has_mask = false;
    std::optional<PoseEstimate> last;  ///< that is to be recorded
    std::size_t images = 0;            ///< in the bag
  };

  bool onRecordSession(RecordSession::Request& request, RecordSession::Response& response);
  std::string begin();
  void end(const std::string& path, RecordSession::Response& response);
  std::string outputOf(const std::string& path) const;
  std::unique_ptr<Session> take();
  SessionExtension saved(const Session& session, const std::string& output) const;
  void work();
  void tryToRecord(Session& session, const LocalizedImage& image);
  void record(Session& session, const LocalizedImage& image) const;
  void sync(Session& session);

  const std::string folder_;
  const Extend extend_;
  ThrottledLog& log_;
  ChildProcess map_edit_;
  mutable std::mutex mutex_;  ///< of all that follows, until the next comment
  std::string map_path_;
  std::shared_ptr<const TrainingMap> map_;
  std::unique_ptr<Session> session_;
  std::deque<LocalizedImage> waiting_;  ///< to be recorded
  bool working_ = false;                ///< the thread has the session's bag
  bool writes_map_ = false;
  bool ends_ = false;
  std::condition_variable changed_;
  ros::CallbackQueue queue_;
  ros::ServiceServer service_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;  ///< a map takes a while, and other services must not wait for it
  std::thread thread_;
};

}  // namespace visual_localization
