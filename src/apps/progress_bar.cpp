#include "progress_bar.h"

#include <cstdio>
#include <utility>

#include <unistd.h>

namespace visual_localization::apps {
namespace {

constexpr std::chrono::milliseconds kDelay{2000};
constexpr std::chrono::milliseconds kInterval{100};
constexpr std::size_t kWidth = 40;

}  // namespace

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)), terminal_(::isatty(STDERR_FILENO) == 1), next_(Clock::now() + kDelay) {}

ProgressBar::~ProgressBar() {
  if (visible_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(std::size_t done, std::size_t total) {
  if (!terminal_ || total == 0 || Clock::now() < next_) return;
  next_ = Clock::now() + kInterval;
  visible_ = true;
  const std::size_t filled = kWidth * done / total;
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r%s [%s] %zu/%zu\033[K", label_.c_str(), bar.c_str(), done, total);
  std::fflush(stderr);
}

}  // namespace visual_localization::apps
