#include "crackle/record/observe_breaks.hpp"

namespace crackle {

void ObserveBreaks::sample_begins(std::int64_t /*index*/) {
  record_.bond.clear();
  record_.load.clear();
  record_.stiffness.clear();
}

void ObserveBreaks::sample_resumes(const SampleRecord& begun) {
  record_.bond = begun.bond;
  record_.load = begun.load;
  record_.stiffness = begun.stiffness;
}

void ObserveBreaks::bond_breaks(std::int32_t /*number*/, const Critical& critical,
                                Equilibrium& /*equilibrium*/) {
  record_.bond.push_back(critical.bond);
  record_.load.push_back(critical.load);
  record_.stiffness.push_back(critical.stiffness);
}

}  // namespace crackle
