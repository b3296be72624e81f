/// `-equilibrium dense`: LAPACK Cholesky of the whole matrix after every break. The reference in tests, for
/// small networks: time grows with the cube of the unknowns, memory with their square.
#pragma once

#include "crackle/equilibrium/equilibrium.hpp"

namespace crackle {

/// Unknowns above which a dense matrix (8 bytes times their square) is refused.
inline constexpr Dof kMostDenseUnknowns = 20000;

/// Throws InputError for a network of more than kMostDenseUnknowns.
[[nodiscard]] std::unique_ptr<Equilibrium> make_equilibrium_dense(const Network& network,
                                                                  const EquilibriumOptions& options,
                                                                  PhaseTimes& times);

}  // namespace crackle
