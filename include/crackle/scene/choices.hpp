/// Choices that have nothing but a name: what the words of an option stand for.
#pragma once

#include <array>

#include "crackle/ensemble/ensemble.hpp"
#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/equilibrium/tree/tree_search.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

template <class Value>
struct Choice {
  const char* name;
  Value value;
};
/// clang 16, which lints, doesn't deduce it from the members.
template <class Value>
Choice(const char*, Value) -> Choice<Value>;

inline constexpr std::array kModels = {Choice{"spring", Model::spring}, Choice{"fuse", Model::fuse}};
inline constexpr std::array kGrips = {Choice{"sliding", Grips::sliding}, Choice{"clamped", Grips::clamped}};
inline constexpr std::array kBreakOns = {Choice{"magnitude", BreakOn::magnitude},
                                         Choice{"tension", BreakOn::tension}};
inline constexpr std::array kPrecisions = {Choice{"single", Precision::single},
                                           Choice{"double", Precision::all_double}};
inline constexpr std::array kMonitors = {Choice{"auto", Monitor::automatic}, Choice{"none", Monitor::none}};

}  // namespace crackle
