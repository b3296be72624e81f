#include "crackle/progress.hpp"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <string>

namespace crackle {

namespace {

constexpr std::chrono::duration<double> kBarEvery{0.1};
constexpr std::chrono::duration<double> kLineEvery{60};
constexpr int kBarWidth = 30;

std::string bar(double share) {
  const int full = static_cast<int>(share * kBarWidth);
  return "[" + std::string(static_cast<std::size_t>(full), '#') +
         std::string(static_cast<std::size_t>(kBarWidth - full), '.') + "]";
}

std::string duration(double seconds) {
  char text[32];
  const long all = std::lround(seconds);
  if (all < 60) {
    std::snprintf(text, sizeof text, "%lds", all);
  } else if (all < 3600) {
    std::snprintf(text, sizeof text, "%ldm%02lds", all / 60, all % 60);
  } else {
    std::snprintf(text, sizeof text, "%ldh%02ldm", all / 3600, all / 60 % 60);
  }
  return text;
}

}  // namespace

Progress::Progress(std::int64_t total, bool silent)
    : total_(total),
      silent_(silent),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(Clock::now()),
      last_(start_) {
  if (!silent_ && terminal_ && total_ > 0) show(start_);
}

Progress::~Progress() {
  if (silent_ || total_ == 0) return;
  if (shown_ != done_) show(Clock::now());
  if (terminal_) std::fputc('\n', stderr);
}

void Progress::sample_done(const SampleSummary& summary) {
  ++done_;
  load_sum_ += summary.peak_load;
  if (silent_) return;
  const auto now = Clock::now();
  if (now - last_ >= (terminal_ ? kBarEvery : kLineEvery)) show(now);
}

void Progress::show(Clock::time_point now) {
  last_ = now;
  shown_ = done_;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double rate = elapsed > 0 ? static_cast<double>(done_) / elapsed : 0;
  const double share = static_cast<double>(done_) / static_cast<double>(total_);
  if (terminal_) std::fprintf(stderr, "\r%s ", bar(share).c_str());
  std::fprintf(stderr, "%lld of %lld samples", static_cast<long long>(done_), static_cast<long long>(total_));
  if (done_ > 0) {
    std::fprintf(stderr, ", %.3g a second, %s left, mean peak load %.4f", rate,
                 duration(static_cast<double>(total_ - done_) / rate).c_str(),
                 load_sum_ / static_cast<double>(done_));
  }
  std::fputs(terminal_ ? "\033[K" : "\n", stderr);
  std::fflush(stderr);
}

}  // namespace crackle
