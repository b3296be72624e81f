/// The samples that a run has still to break, in the order in which they are handed out.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <vector>

namespace crackle {

/// Samples first .. first + count - 1 of one size of the run.
struct Chunk {
  int run = 0;
  std::int64_t first = 0;
  std::int64_t count = 0;
};

/// Seconds that a chunk of several samples should take: short beside any run, long beside a message.
inline constexpr double kChunkSeconds = 0.1;

class SampleQueue {
 public:
  /// `workers` take samples at the same time.
  explicit SampleQueue(int workers) : workers_(workers) {}

  /// Appends samples first .. end - 1 of a run but for those finished; runs in descending order of their samples' work.
  void append(int run, std::int64_t first, std::int64_t end, const std::set<std::int64_t>& finished);

  /// So many samples of the run took so long. Chunks follow from it.
  void note(int run, std::int64_t samples, double seconds);

  /// The next samples: one while nothing is known of their run, later what takes kChunkSeconds, fewer near the end of
  /// the run, so that all workers finish together.
  [[nodiscard]] std::optional<Chunk> take();

  /// Samples of a run that have not been taken.
  [[nodiscard]] std::int64_t left(int run) const;
  /// Mean seconds of a sample of the run; 0: not known yet.
  [[nodiscard]] double seconds_per_sample(int run) const;

 private:
  struct Known {
    std::int64_t left = 0;
    std::int64_t samples = 0;
    double seconds = 0;
  };
  Known& known(int run);

  int workers_;
  std::deque<Chunk> pieces_;
  std::vector<Known> known_;
};

}  // namespace crackle
