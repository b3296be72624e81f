/// Tells a waiting person how far a run is.
#pragma once

#include <chrono>
#include <cstdint>

#include "crackle/observer.hpp"

namespace crackle {

class Progress {
 public:
  /// On a terminal (standard error): one line that is redrawn; elsewhere a line a minute and one at the end.
  /// `silent`: nothing. `total`: samples still to break.
  Progress(std::int64_t total, bool silent);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void sample_done(const SampleSummary& summary);

 private:
  using Clock = std::chrono::steady_clock;
  void show(Clock::time_point now);

  std::int64_t total_;
  std::int64_t done_ = 0;
  std::int64_t shown_ = -1;
  double load_sum_ = 0;
  bool silent_;
  bool terminal_;
  Clock::time_point start_;
  Clock::time_point last_;
};

}  // namespace crackle
