#include "apps/progress_bar.h"

#include <array>
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
    : label_(std::move(label)), terminal_(::isatty(STDERR_FILENO) == 1), start_(Clock::now()), next_(start_ + kDelay) {}

ProgressBar::~ProgressBar() {
  if (visible_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(std::size_t done, std::size_t total) {
  if (!terminal_ || total == 0 || Clock::now() < next_) return;
  next_ = Clock::now() + kInterval;
  visible_ = true;
  const std::size_t filled = kWidth * done / total;
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r%s [%s] %zu/%zu%s\033[K", label_.c_str(), bar.c_str(), done, total,
               timeLeft(done, total).c_str());
  std::fflush(stderr);
}

/// From the pace so far; nothing while that says little.
std::string ProgressBar::timeLeft(std::size_t done, std::size_t total) const {
  if (done == 0) return "";
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
  const auto left_s = static_cast<long>(elapsed_s * static_cast<double>(total - done) / static_cast<double>(done));
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), ", %ld:%02ld left", left_s / 60, left_s % 60);
  return text.data();
}

}  // namespace visual_localization::apps
