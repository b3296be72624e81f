#include "crackle/base/phase.hpp"

#include <petscsys.h>

namespace crackle {

namespace {

/// One PETSc event a phase, "crackle_NAME", registered at first use.
PetscLogEvent event(Phase phase) {
  static const auto events = [] {
    PetscClassId id = 0;
    std::array<PetscLogEvent, kPhases> made{};
    PetscClassIdRegister("crackle", &id);
    for (std::size_t i = 0; i < kPhases; ++i) {
      PetscLogEventRegister((std::string("crackle_") + kPhaseNames[i]).c_str(), id, &made[i]);
    }
    return made;
  }();
  return events[static_cast<std::size_t>(phase)];
}

}  // namespace

PhaseScope::PhaseScope(PhaseTimes& times, Phase phase)
    : times_(times), phase_(phase), start_(std::chrono::steady_clock::now()) {
  PetscLogEventBegin(event(phase_), 0, 0, 0, 0);
}

PhaseScope::~PhaseScope() {
  PetscLogEventEnd(event(phase_), 0, 0, 0, 0);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start_;
  times_.seconds[static_cast<std::size_t>(phase_)] += taken.count();
}

}  // namespace crackle
