/// One process at work: asks for samples, breaks them, writes them.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "crackle/ensemble/ensemble.hpp"
#include "crackle/ensemble/hand_out.hpp"
#include "crackle/record/shards.hpp"

namespace crackle {

/// What a process needs to break samples of one size. Only a group's leader observes and writes.
class Workplace {
 public:
  /// Shards of this process have the numbers ranks.group_number(), + ranks.groups(), ...
  Workplace(const Run& run, int number, std::unique_ptr<Equilibrium> equilibrium, const Ranks& ranks,
            HandOut& hand_out, PhaseTimes& times);

  /// Breaks the samples, and tells of them in `report`. Collective over the group. Errors go to the hand-out.
  void break_chunk(const Chunk& chunk, Report& report);

  /// The output may be written from now on.
  void allow_writing() { writable_ = true; }

  /// Writes what waits, if it may: now, or when it has waited long enough; tells of it in `report`.
  void save(Report& report, bool now);

  [[nodiscard]] bool waiting() const { return shards_ && shards_->waiting(); }
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] const Equilibrium& equilibrium() const { return *equilibrium_; }

 private:
  [[nodiscard]] bool set_thresholds(std::int64_t index);
  [[nodiscard]] bool break_one(std::int64_t index);
  [[nodiscard]] bool break_on(Fracture& sample);
  [[nodiscard]] std::optional<SampleRecord> find_begun(std::int64_t index);
  void keep(const Fracture& sample);
  void write_kept();
  template <class Work>
  void as_leader(Work work);

  const Run& run_;
  int number_;
  const Ranks& ranks_;
  HandOut& hand_out_;
  PhaseTimes& times_;
  std::unique_ptr<Equilibrium> equilibrium_;
  SampleRecord record_;
  std::vector<std::unique_ptr<Observer>> owned_;
  std::vector<Observer*> observers_;
  std::vector<double> threshold_;
  std::optional<ShardWriter> shards_;  ///< of a leader
  bool writable_ = false;
  RunningMean unsaved_;  ///< peak loads of samples that wait
  // the sample that is being broken
  std::optional<SampleRecord> settled_;  ///< as it was when it settled last, unless that is on disk
  std::chrono::steady_clock::time_point kept_;
};

}  // namespace crackle
