/// Where the time of a run goes: seconds by phase for the summary, PETSc log events for -log_view.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

namespace crackle {

/// In the order of the summary.
enum class Phase : std::uint8_t { assembly, factor, downdate, solve, search, output };
inline constexpr std::array kPhaseNames = {"assembly", "factor", "downdate", "solve", "search", "output"};
inline constexpr std::size_t kPhases = kPhaseNames.size();

/// Seconds spent in each phase, indexed by Phase.
struct PhaseTimes {
  std::array<double, kPhases> seconds{};

  [[nodiscard]] double operator[](Phase phase) const { return seconds[static_cast<std::size_t>(phase)]; }
};

/// Adds the time of its own life to one phase. Scopes don't nest.
class PhaseScope {
 public:
  PhaseScope(PhaseTimes& times, Phase phase);
  ~PhaseScope();
  PhaseScope(const PhaseScope&) = delete;
  PhaseScope& operator=(const PhaseScope&) = delete;

 private:
  PhaseTimes& times_;
  Phase phase_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace crackle
