#include "crackle/ensemble/workplace.hpp"

#include <array>
#include <exception>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/record/part.hpp"

namespace crackle {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Only the observers that the scene asks for; breaks in any case where samples can be resumed from them.
std::vector<std::unique_ptr<Observer>> make_observers(const Run& run, SampleRecord& record) {
  const PartScene scene{run.network, run.output.record, run.section_height};
  std::vector<std::unique_ptr<Observer>> observers;
  for (const RecordPart* part : record_parts()) {
    if (part == record_parts().front() || run.output.record.has(part->name))
      observers.push_back(part->observe(scene, record));
  }
  return observers;
}

}  // namespace

Workplace::Workplace(const Run& run, int number, std::unique_ptr<Equilibrium> equilibrium, const Ranks& ranks,
                     HandOut& hand_out, PhaseTimes& times)
    : run_(run),
      number_(number),
      ranks_(ranks),
      hand_out_(hand_out),
      times_(times),
      equilibrium_(std::move(equilibrium)),
      threshold_(run.network.lattice.bond.size()) {
  if (!ranks.leader()) return;
  owned_ = make_observers(run, record_);
  for (const auto& observer : owned_) observers_.push_back(observer.get());
  shards_.emplace(run.output.path, run.header, run.output.record, ranks.group_number(), ranks.groups());
}

/// What only a leader does may fail there alone: the others learn of it through the hand-out.
template <class Work>
void Workplace::as_leader(Work work) {
  if (!ranks_.leader()) return;
  const PhaseScope scope(times_, Phase::output);
  try {
    work();
  } catch (const std::exception& error) {
    hand_out_.fail(explain(error));
  }
}

void Workplace::break_chunk(const Chunk& chunk, Report& report) {
  report.run = number_;
  for (std::int64_t index = chunk.first; index < chunk.first + chunk.count; ++index) {
    const auto start = Clock::now();
    if (!break_one(index)) return;
    as_leader([this] {
      if (run_.output.record.has("breaks")) {
        shards_->add(record_);
      } else {
        SampleRecord slim = record_;
        slim.bond.clear();
        slim.load.clear();
        slim.stiffness.clear();
        shards_->add(std::move(slim));
      }
    });
    unsaved_.add(record_.summary.peak_load);
    save(report, false);
    ++report.finished;
    report.seconds += seconds_since(start);
  }
}

void Workplace::save(Report& report, bool now) {
  if (!writable_ || !shards_ || !(now || shards_->due())) return;
  as_leader([&] {
    shards_->flush();
    report.saved_run = number_;
    report.saved.add(std::exchange(unsaved_, {}));
  });
}

/// False: this sample can't have any.
bool Workplace::set_thresholds(std::int64_t index) {
  try {
    thresholds_of(run_, index, threshold_);
    return true;
  } catch (const std::exception& error) {
    hand_out_.fail(error.what());
    return false;
  }
}

/// False: the run ends, the sample is not finished.
bool Workplace::break_one(std::int64_t index) {
  if (!set_thresholds(index)) return false;
  const std::int64_t chosen = run_.ensemble.checkpoint_breaks;
  Fracture sample(*equilibrium_, run_.ensemble.stop, observers_,
                  chosen > 0 ? chosen : equilibrium_->breaks_worth_settling());
  settled_.reset();
  kept_ = Clock::now();
  const std::optional<SampleRecord> begun = find_begun(index);
  try {
    if (begun) {
      sample.resume(*begun, threshold_);
    } else {
      sample.begin(index, threshold_);
    }
    return break_on(sample);
  } catch (const std::exception& error) {
    hand_out_.fail(explain(error));
    return false;
  }
}

bool Workplace::break_on(Fracture& sample) {
  while (sample.step()) {
    if (sample.settled()) keep(sample);
    if (hand_out_.stopping()) {
      if (settled_) write_kept();
      return false;
    }
  }
  record_.summary = sample.summary();
  return true;
}

/// The leader's checkpoint; the others need no more of it than what has broken.
std::optional<SampleRecord> Workplace::find_begun(std::int64_t index) {
  if (!run_.output.resume) return std::nullopt;
  std::optional<SampleRecord> begun;
  as_leader([&] { begun = shards_->read_checkpoint(index, run_.network.bonds()); });
  std::array<std::int64_t, 2> found{begun ? 1 : 0, begun ? std::ssize(begun->bond) : 0};
  ranks_.share(found);
  if (found[0] == 0) return std::nullopt;
  if (!begun) begun.emplace();
  begun->bond.resize(static_cast<std::size_t>(found[1]));
  ranks_.share(begun->bond);
  ranks_.share(begun->summary);
  return begun;
}

void Workplace::keep(const Fracture& sample) {
  if (!ranks_.leader()) return;
  settled_ = record_;
  settled_->summary = sample.summary();
  if (seconds_since(kept_) >= run_.ensemble.checkpoint_every) write_kept();
}

void Workplace::write_kept() {
  as_leader([this] {
    writable_ = writable_ || hand_out_.claim(number_);
    if (!writable_) return;
    shards_->write_checkpoint(*settled_);
    settled_.reset();
    kept_ = Clock::now();
  });
}

}  // namespace crackle
