/// A comparison on the terminal: one line a strategy.
#pragma once

#include <span>
#include <string>

#include "crackle/compare/compare_run.hpp"

namespace crackle {

/// Time per break (median over the repetitions, and half their spread), iterations a break, largest errors, first
/// difference, memory; then what each strategy said.
[[nodiscard]] std::string format_comparison(const ReferenceRun& reference, std::span<const StrategyRun> runs,
                                            const CompareOptions& options);

}  // namespace crackle
