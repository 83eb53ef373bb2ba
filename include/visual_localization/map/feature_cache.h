#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>

namespace visual_localization {

/// Keeps what was used last, up to a number of bytes. Not thread-safe. `T`: what is kept; never null.
template <class T>
class FeatureCache {
 public:
  using Pointer = std::shared_ptr<const T>;
  /// What a value costs besides: nodes of two containers, and the heap's own bookkeeping.
  static constexpr std::size_t kBookkeeping_bytes = 256;

  explicit FeatureCache(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  /// Null when it is not kept (any more).
  Pointer find(std::uint64_t key) {
    const auto found = places_.find(key);
    if (found == places_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->value;
  }

  /// Keeps `value`, that takes `bytes`, in the place of what was used longest ago. One that is larger than the limit
  /// or is kept already changes nothing.
  void add(std::uint64_t key, Pointer value, std::size_t bytes) {
    bytes += kBookkeeping_bytes;
    if (bytes > limit_bytes_ || places_.count(key) != 0) return;
    while (used_bytes_ > limit_bytes_ - bytes) {
      used_bytes_ -= entries_.back().bytes;
      places_.erase(entries_.back().key);
      entries_.pop_back();
    }
    entries_.push_front({key, std::move(value), bytes});
    places_.emplace(key, entries_.begin());
    used_bytes_ += bytes;
  }

  std::size_t size() const { return entries_.size(); }
  std::size_t used_bytes() const { return used_bytes_; }

 private:
  struct Entry {
    std::uint64_t key;
    Pointer value;
    std::size_t bytes;
  };
  std::size_t limit_bytes_;
  std::size_t used_bytes_ = 0;
  std::list<Entry> entries_;  ///< the one used last first
  std::unordered_map<std::uint64_t, typename std::list<Entry>::iterator> places_;
};

}  // namespace visual_localization
