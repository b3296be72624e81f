#include "crackle/equilibrium/strategies/strategies.hpp"

#include <array>

#include "crackle/base/error.hpp"
#include "crackle/base/named.hpp"
#include "crackle/equilibrium/dense/equilibrium_dense.hpp"
#include "crackle/equilibrium/quad/equilibrium_quad.hpp"

namespace crackle {

namespace {

std::unique_ptr<Equilibrium> make_tree(const Network& network, const ChosenStrategy& options,
                                       PhaseTimes& times) {
  return make_equilibrium_tree(network, options.common, times, options.tree);
}

std::unique_ptr<Equilibrium> make_ksp(const Network& network, const ChosenStrategy& options,
                                      PhaseTimes& times) {
  return make_equilibrium_ksp(network, options.common, times, options.ksp);
}

std::unique_ptr<Equilibrium> make_dense(const Network& network, const ChosenStrategy& options,
                                        PhaseTimes& times) {
  return make_equilibrium_dense(network, options.common, times);
}

std::unique_ptr<Equilibrium> make_quad(const Network& network, const ChosenStrategy& options,
                                       PhaseTimes& times) {
  return make_equilibrium_quad(network, options.common, times);
}

std::string describe_tree(const Equilibrium& equilibrium) {
  return describe(tree_counts(equilibrium));
}

constexpr std::array kStrategies = {
    StrategyKind{.name = "tree",
                 .meaning = "a factor on a separator tree, breaks verified several at a time",
                 .make = make_tree,
                 .describe = describe_tree,
                 .looks_ahead = true},
    StrategyKind{.name = "ksp",
                 .meaning = "a PETSc KSP (the default when a -ksp_ or -pc_ option is given)",
                 .make = make_ksp,
                 .describe = nullptr,
                 .looks_ahead = false},
    StrategyKind{.name = "dense",
                 .meaning = "LAPACK, for small networks",
                 .make = make_dense,
                 .describe = nullptr,
                 .looks_ahead = false},
    StrategyKind{.name = "quad",
                 .meaning = "a factor in 113 bits, where stiffnesses are too far apart for the others",
                 .make = make_quad,
                 .describe = nullptr,
                 .looks_ahead = false},
};

}  // namespace

std::span<const StrategyKind> strategy_kinds() {
  return kStrategies;
}

std::string equilibrium_names() {
  return any_of(names_of(kStrategies));
}

const StrategyKind& find_strategy(const std::string& name) {
  const StrategyKind* const kind = find_named(kStrategies, name);
  if (kind == nullptr) throw InputError("-equilibrium", name, equilibrium_names());
  return *kind;
}

std::unique_ptr<Equilibrium> make_equilibrium(const Network& network, const ChosenStrategy& options,
                                              PhaseTimes& times) {
  return find_strategy(options.strategy).make(network, options, times);
}

}  // namespace crackle
