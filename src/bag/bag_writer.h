#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <ros/time.h>

namespace visual_localization {

/// Named after the local time: "session_2026-11-22-07-15-00.bag".
std::string newSessionBag(const std::string& folder);

/// Writes a bag (format 2.0) that is whole after every sync(), whatever happens later; rosbag_storage writes the index
/// when the bag is closed. Each sync() appends a chunk and an index of all that is before it, flushes both, and only
/// then lets the header point to that index.
class BagWriter {
 public:
  /// Throws FileError, also when the file exists already.
  explicit BagWriter(const std::string& path);
  ~BagWriter();
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  /// For the next sync(). False, and the message is lost, when more than 64 MiB wait. `latched`: who plays the bag is
  /// to latch the topic.
  template <class Message>
  bool write(const std::string& topic, const ros::Time& received, const Message& message, bool latched = false) {
    namespace traits = ros::message_traits;
    const Kind kind{topic, traits::datatype(message), traits::md5sum(message), traits::definition(message), latched};
    std::string bytes(ros::serialization::serializationLength(message), '\0');
    ros::serialization::OStream out(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                    static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::serialize(out, message);
    return add(kind, received, bytes);
  }

  /// Throws FileError, for instance when the disk is full: then the bag is as it was, and the messages wait for the
  /// next sync().
  void sync();

  /// Bytes.
  std::uint64_t size() const { return end_; }
  /// Bytes of the messages since the last sync().
  std::uint64_t waiting() const { return chunk_.size(); }
  /// Bytes of the index that the next sync() writes: it grows with each.
  std::uint64_t indexSize() const { return connection_records_.size() + chunk_infos_.size(); }
  const std::string& path() const { return path_; }

 private:
  /// Where messages come from, and how they are read.
  struct Kind {
    std::string topic;
    std::string type;
    std::string md5sum;
    std::string definition;
    bool latched = false;
  };
  struct Entry {
    ros::Time received;
    std::uint32_t offset = 0;  ///< in its chunk
  };
  using Index = std::map<std::uint32_t, std::vector<Entry>>;  ///< by connection

  bool add(const Kind& kind, const ros::Time& received, const std::string& bytes);
  std::uint32_t connectionOf(const Kind& kind);
  std::string indexRecords() const;
  std::string chunkInfo() const;
  void put(std::uint64_t offset, const std::string& bytes);
  void flush();

  std::string path_;
  int file_ = -1;
  std::uint64_t end_ = 0;                                                     ///< where the next chunk goes
  std::map<std::pair<std::string, std::string>, std::uint32_t> connections_;  ///< by topic and type
  std::string connection_records_;
  std::string chunk_infos_;
  std::uint32_t chunks_ = 0;
  std::string chunk_;  ///< messages since the last sync()
  Index index_;        ///< of them
};

}  // namespace visual_localization
