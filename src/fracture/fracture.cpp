#include "crackle/fracture/fracture.hpp"

#include "crackle/base/error.hpp"
#include "crackle/fracture/peak.hpp"

namespace crackle {

namespace {

void count_break(const Critical& next, SampleSummary& summary) {
  ++summary.n_f;
  if (!is_new_peak(next.load, summary.peak_load, summary.n_p)) return;
  summary.n_p = summary.n_f;
  summary.peak_load = next.load;
  summary.peak_displacement = next.load / next.stiffness;
}

void check_end(State state, const SampleSummary& summary, const Equilibrium& equilibrium) {
  const std::string place =
      "sample " + std::to_string(summary.index) + ", after break " + std::to_string(summary.n_f);
  if (state == State::unsolved) throw SolverError(place + ": " + equilibrium.complaint());
  if ((state == State::failed || state == State::held) && summary.n_f == 0) {
    const std::string doubt = describe_doubt(equilibrium.counts());
    throw SolverError(place +
                      ": no bond of the intact network carries load and can break; are its grips rigidly "
                      "joined, or is it a mechanism?" +
                      (doubt.empty() ? "" : " (" + doubt + ")"));
  }
}

}  // namespace

Fracture::Fracture(Equilibrium& equilibrium, const StopRule& stop, std::span<Observer* const> observers,
                   std::int64_t settle_every)
    : equilibrium_(equilibrium), stop_(stop), observers_(observers), settle_every_(settle_every) {}

void Fracture::begin(std::int64_t index, std::span<const double> threshold) {
  start_ = std::chrono::steady_clock::now();
  earlier_ = 0;
  settled_ = false;
  summary_ = {.index = index};
  for (Observer* observer : observers_) observer->sample_begins(index);
  equilibrium_.reset(threshold);
}

void Fracture::resume(const SampleRecord& begun, std::span<const double> threshold) {
  start_ = std::chrono::steady_clock::now();
  earlier_ = begun.summary.wall_time;
  settled_ = true;
  summary_ = begun.summary;
  for (Observer* observer : observers_) {
    observer->sample_begins(summary_.index);
    observer->sample_resumes(begun);
  }
  equilibrium_.resume(threshold, begun.bond, summary_.initial_stiffness);
}

bool Fracture::step() {
  Critical next;
  settled_ = false;
  const State state = equilibrium_.find_critical(next);
  if (state == State::carrying) summary_.initial_stiffness = equilibrium_.intact_stiffness();
  if (state != State::carrying || is_reached(stop_, summary_.n_f, summary_.initial_stiffness, next)) {
    finish(state);
    return false;
  }
  count_break(next, summary_);
  for (Observer* observer : observers_) observer->bond_breaks(summary_.n_f, next, equilibrium_);
  equilibrium_.remove(next.bond);
  settled_ = settle_every_ > 0 && summary_.n_f % settle_every_ == 0;
  if (settled_) equilibrium_.settle();
  return true;
}

SampleSummary Fracture::summary() const {
  SampleSummary now = summary_;
  now.wall_time = earlier_ + std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  return now;
}

void Fracture::finish(State state) {
  check_end(state, summary_, equilibrium_);
  const SampleSummary ended = summary();
  for (Observer* observer : observers_) observer->sample_ends(ended);
}

SampleSummary break_sample(Equilibrium& equilibrium, std::int64_t index, std::span<const double> threshold,
                           const StopRule& stop, std::span<Observer* const> observers) {
  Fracture sample(equilibrium, stop, observers);
  sample.begin(index, threshold);
  while (sample.step()) {
  }
  return sample.summary();
}

}  // namespace crackle
