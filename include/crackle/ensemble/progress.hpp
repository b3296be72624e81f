/// Tells a waiting person how far a run is.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "crackle/base/running_mean.hpp"

namespace crackle {

/// Samples of one size.
struct ProgressPart {
  std::string name;        ///< "L = 32"; empty where there is no other
  std::int64_t total = 0;  ///< samples still to break when the run starts
  double work = 1;         ///< of a sample, relative to the other parts': until its time is known
};

class Progress {
 public:
  /// On a terminal (standard error): one line that is redrawn; elsewhere a line a minute and one at the end.
  /// `silent`: nothing. `workers` break samples at the same time.
  Progress(std::vector<ProgressPart> parts, int workers, bool silent);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Peak loads of more samples of a part, and the seconds that one takes (0: not known).
  void add(int part, const RunningMean& loads, double seconds_per_sample);

  /// The line as it is now.
  [[nodiscard]] std::string line() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct State {
    ProgressPart part;
    RunningMean load;
    double seconds = 0;  ///< a sample; 0: not known
  };
  [[nodiscard]] double seconds_left() const;
  void show(Clock::time_point now);

  std::vector<State> states_;
  int workers_;
  bool silent_;
  bool terminal_;
  std::size_t latest_ = 0;  ///< the part that was added to last
  std::int64_t total_ = 0;
  std::int64_t done_ = 0;
  std::int64_t shown_ = -1;
  Clock::time_point last_;
};

}  // namespace crackle
