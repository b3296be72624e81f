/// The strategies: one table. A new one is a folder beside `tree`, a row in strategies.cpp, and a file in options/solver/.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/equilibrium/ksp/equilibrium_ksp.hpp"
#include "crackle/equilibrium/tree/equilibrium_tree.hpp"

namespace crackle {

/// A strategy by its name, and what it is told. Options of the others lie idle.
struct ChosenStrategy {
  std::string strategy = "tree";  ///< a name in the table
  EquilibriumOptions common{};
  KspOptions ksp{};
  TreeOptions tree{};
};

struct StrategyKind {
  const char* name;     ///< in `-equilibrium`
  const char* meaning;  ///< one line
  /// Throws InputError for a network, or options, that it can't work with.
  std::unique_ptr<Equilibrium> (*make)(const Network& network, const ChosenStrategy& options,
                                       PhaseTimes& times);
  /// What it did beyond EquilibriumCounts, several lines; null: there is no more to tell.
  /// Of an Equilibrium that `make` made.
  std::string (*describe)(const Equilibrium& equilibrium);
  bool
      looks_ahead;  ///< finds breaks before they are asked for: find_critical is to come before every removal
};

/// The default first.
[[nodiscard]] std::span<const StrategyKind> strategy_kinds();

/// Names that `-equilibrium` takes, for messages: "tree, ksp, dense or quad".
[[nodiscard]] std::string equilibrium_names();

/// Throws InputError for a name that is not in the table.
[[nodiscard]] const StrategyKind& find_strategy(const std::string& name);

/// The strategy that options.strategy names; throws as find_strategy and its `make` do.
/// PETSc-based strategies read their solver's options from the PETSc options database.
[[nodiscard]] std::unique_ptr<Equilibrium> make_equilibrium(const Network& network,
                                                            const ChosenStrategy& options, PhaseTimes& times);

}  // namespace crackle
