#include "crackle/fracture.hpp"

#include <chrono>

#include "crackle/error.hpp"

namespace crackle {

namespace {

bool reached(const StopRule& stop, const SampleSummary& so_far, const Critical& next) {
  switch (stop.kind) {
    case StopRule::Kind::failure:
      return false;
    case StopRule::Kind::stiffness:
      return next.stiffness < stop.value * so_far.initial_stiffness;
    case StopRule::Kind::breaks:
      return so_far.n_f >= stop.value;
    case StopRule::Kind::displacement:
      return next.load / next.stiffness > stop.value;
  }
  return false;
}

void count_break(const Critical& next, SampleSummary& summary) {
  ++summary.n_f;
  if (next.load <= summary.peak_load && summary.n_p > 0) return;
  summary.n_p = summary.n_f;
  summary.peak_load = next.load;
  summary.peak_displacement = next.load / next.stiffness;
}

void check_end(State state, const SampleSummary& summary, const Equilibrium& equilibrium) {
  const std::string place =
      "sample " + std::to_string(summary.index) + ", after break " + std::to_string(summary.n_f);
  if (state == State::unsolved) throw SolverError(place + ": " + equilibrium.complaint());
  if (state == State::failed && summary.n_f == 0) {
    throw SolverError(
        place + ": no bond of the intact network carries load and can break; are its grips rigidly joined?");
  }
}

}  // namespace

SampleSummary break_sample(Equilibrium& equilibrium, std::int64_t index, std::span<const double> threshold,
                           const StopRule& stop, std::span<Observer* const> observers) {
  const auto start = std::chrono::steady_clock::now();
  SampleSummary summary{.index = index};
  for (Observer* observer : observers) observer->sample_begins(index);
  equilibrium.reset(threshold);
  Critical next;
  State state = State::carrying;
  while ((state = equilibrium.find_critical(next)) == State::carrying) {
    summary.initial_stiffness = equilibrium.intact_stiffness();
    if (reached(stop, summary, next)) break;
    count_break(next, summary);
    for (Observer* observer : observers) observer->bond_breaks(summary.n_f, next, equilibrium);
    equilibrium.remove(next.bond);
  }
  check_end(state, summary, equilibrium);
  summary.wall_time = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (Observer* observer : observers) observer->sample_ends(summary);
  return summary;
}

}  // namespace crackle
