#pragma once

#include <cstdint>
#include <string>

#include <ros/time.h>

#include "bag/bag_writer.h"

namespace visual_localization {

/// By the clock of a simulation, which stands at zero before its first message: then by the computer's.
ros::Time receivedNow();

/// The bag of a session that is recorded now, which is put on the disk from time to time. Not thread-safe.
class SessionBag {
 public:
  /// Throws FileError.
  explicit SessionBag(const std::string& folder) : bag_(newSessionBag(folder)) {}

  template <class Message>
  void write(const std::string& topic, const Message& message, bool latched) {
    bag_.write(topic, receivedNow(), message, latched) ? ++recorded_ : ++lost_;
    if (bag_.waiting() >= kMostWaiting_bytes && trouble_.empty()) sync();
  }
  void sync();
  /// The same when as much waits as is worth it.
  void syncSometimes();

  const std::string& path() const { return bag_.path(); }
  std::uint64_t size() const { return bag_.size(); }
  std::uint64_t recorded() const { return recorded_; }
  std::uint64_t lost() const { return lost_; }
  /// Why the last sync failed; empty when it did not.
  const std::string& trouble() const { return trouble_; }

 private:
  /// Raw images of a fast camera do not wait for the period.
  static constexpr std::uint64_t kMostWaiting_bytes = 16U << 20U;

  BagWriter bag_;
  std::uint64_t recorded_ = 0;
  std::uint64_t lost_ = 0;
  std::string trouble_;
};

}  // namespace visual_localization
