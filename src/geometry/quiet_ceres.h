#pragma once

#include <utility>

#include <glog/logging.h>

namespace visual_localization {

/// A step that cannot be solved is tried again with more damping. Ceres warns of each on stderr, but not while one of
/// these lives.
class QuietCeres {
 public:
  QuietCeres() : before_(std::exchange(FLAGS_minloglevel, google::GLOG_ERROR)) {}
  ~QuietCeres() { FLAGS_minloglevel = before_; }
  QuietCeres(const QuietCeres&) = delete;
  QuietCeres& operator=(const QuietCeres&) = delete;

 private:
  int before_;
};

}  // namespace visual_localization
