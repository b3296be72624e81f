/// Hands the samples of a run out to the groups of processes, as they ask for them.
///
/// The first process keeps the queue and works itself: it looks for questions between its own breaks. A process asks
/// when it has broken what it got, and reports. Whatever ends the run early (a signal, an error, anywhere) reaches
/// every process between two of its breaks.
#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <string>

#include "crackle/base/ranks.hpp"
#include "crackle/base/running_mean.hpp"
#include "crackle/ensemble/progress.hpp"
#include "crackle/ensemble/sample_queue.hpp"

namespace crackle {

/// What a group has done since its last report.
struct Report {
  int run = 0;                         ///< size of the run
  std::int64_t finished = 0;           ///< samples of it,
  double seconds = 0;                  ///< and how long they took
  bool waiting = false;                ///< some wait to be written
  int saved_run = 0;                   ///< size of the run, maybe an earlier one,
  RunningMean saved;                   ///< of which samples with these peak loads have come to disk
  int signal = 0;                      ///< that asked the run to end
  std::array<char, 1000> complaint{};  ///< why it can't go on; empty: it can
};

/// What the first process says to a report.
struct Answer {
  bool work = false;     ///< the chunk is to be broken; false: there is no more
  bool claimed = false;  ///< the output of the report's run may be written
  Chunk chunk;
};

/// How a run ended.
struct RunEnd {
  int signal = 0;                      ///< that ended it early
  std::array<char, 1000> complaint{};  ///< the first error anywhere; empty: none
};

class HandOut {
 public:
  /// queue, progress: of use in the first process only. claim(run): called there, before anything of that run is
  /// written anywhere; may throw. All arguments must outlive this.
  HandOut(const Ranks& ranks, SampleQueue& queue, Progress& progress, std::function<void(int)> claim);

  /// Reports, and gets more to do. Collective over the group; what its leader says counts.
  [[nodiscard]] Answer next(const Report& report);

  /// Asks for leave to write the output of a run before a sample is done. In a leader; false: the run ends.
  [[nodiscard]] bool claim(int run);

  /// Between two breaks: true when the run ends early. Collective over the group.
  [[nodiscard]] bool stopping();

  /// The leader has met an error: stopping() is true from now on, next() has nothing to do.
  void fail(const std::string& complaint);

  /// The last report; returns when every group has given its own. Collective over all processes.
  [[nodiscard]] RunEnd leave(Report report);

 private:
  struct Question;
  struct Message;
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] Message converse(const Question& question);
  [[nodiscard]] Answer serve(const Report& report);
  void look_for_questions();
  void answer(int leader, const Question& question);
  [[nodiscard]] bool take_note(const Report& report);
  void tell_all_to_stop();
  [[nodiscard]] Report with_troubles(Report report) const;

  const Ranks& ranks_;
  SampleQueue& queue_;
  Progress& progress_;
  std::function<void(int)> claim_;
  bool stopping_ = false;
  std::array<char, 1000> complaint_{};
  Clock::time_point last_look_;
  // of the first process
  RunEnd end_;
  std::vector<bool> here_;  ///< [groups] has not left yet
  bool told_ = false;       ///< the others, to stop
};

}  // namespace crackle
