#include "crackle/ensemble/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

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

/// Of the terminal that standard error is.
std::size_t columns() {
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0;  // NOLINT(*-vararg): POSIX
  return known && size.ws_col > 1 ? size.ws_col : 80;
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

Progress::Progress(std::vector<ProgressPart> parts, int workers, bool silent)
    : workers_(workers), silent_(silent), terminal_(isatty(STDERR_FILENO) != 0), last_(Clock::now()) {
  for (ProgressPart& part : parts) {
    total_ += part.total;
    states_.push_back({.part = std::move(part), .load = {}});
  }
  if (!silent_ && terminal_ && total_ > 0) show(last_);
}

Progress::~Progress() {
  if (silent_ || total_ == 0) return;
  if (shown_ != done_) show(Clock::now());
  if (terminal_) std::fputc('\n', stderr);
}

void Progress::add(int part, const RunningMean& loads, double seconds_per_sample) {
  if (loads.count() > 0) latest_ = static_cast<std::size_t>(part);
  State& state = states_[part];
  done_ += loads.count();
  state.load.add(loads);
  state.seconds = seconds_per_sample;
  if (silent_) return;
  const auto now = Clock::now();
  if (now - last_ >= (terminal_ ? kBarEvery : kLineEvery)) show(now);
}

/// A part that has not begun: from the time of the others, by their work.
double Progress::seconds_left() const {
  double seconds = 0;
  double per_work = 0;
  for (const State& state : states_) {
    if (state.seconds > 0) per_work = state.seconds / state.part.work;
  }
  for (const State& state : states_) {
    const auto left = static_cast<double>(state.part.total - state.load.count());
    seconds += left * (state.seconds > 0 ? state.seconds : per_work * state.part.work);
  }
  return seconds / workers_;
}

std::string Progress::line() const {
  const State& state = states_[latest_];
  const auto count = [](std::int64_t done, std::int64_t total) {
    return std::to_string(done) + " of " + std::to_string(total);
  };
  std::string text = state.part.name.empty() ? "" : state.part.name + ": ";
  text += count(state.load.count(), state.part.total) + " samples";
  if (states_.size() > 1) text += " (" + count(done_, total_) + " in all)";
  if (state.load.count() == 0) return text;
  std::array<char, 200> rest{};
  if (state.seconds > 0) {
    std::snprintf(rest.data(), rest.size(), ", %.3g a second, %s left", workers_ / state.seconds,
                  duration(seconds_left()).c_str());
    text += rest.data();
  }
  std::snprintf(rest.data(), rest.size(), ", mean peak load %.4f +- %.4f", state.load.mean(),
                state.load.error());
  return text + rest.data();
}

void Progress::show(Clock::time_point now) {
  last_ = now;
  shown_ = done_;
  std::string text = line();
  if (terminal_) {
    // a line that wraps can't be redrawn
    const std::size_t room = columns() - 1;
    const std::string share = bar(static_cast<double>(done_) / static_cast<double>(total_)) + " ";
    if (share.size() + text.size() <= room) text.insert(0, share);
    text.resize(std::min(text.size(), room));
  }
  std::fprintf(stderr, terminal_ ? "\r%s\033[K" : "%s\n", text.c_str());
  std::fflush(stderr);
}

}  // namespace crackle
