/// `-equilibrium tree`: a factor on a nested-dissection tree, and breaks verified several at a time.
///
/// K is factorized once, with the plate as its last unknown, and restored by a copy for every sample. Of the
/// bonds nearest to breaking, their Gram matrix predicts who breaks next; one backward pass, no forward
/// sweep, gives every force after each predicted break; what it confirms is handed out one by one.
#pragma once

#include <memory>
#include <string>

#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/equilibrium/tree/separator_tree.hpp"
#include "crackle/equilibrium/tree/tree_batch.hpp"

namespace crackle {

struct TreeOptions {
  bool verify = false;  ///< compare every break with a full solve by a fresh factor: slow, for tests
  Dissection dissection = Dissection::automatic;
  Precision precision = Precision::single;  ///< of the search; loads, forces and order are those of double
  bool responses = true;                    ///< small networks by TreeResponse, as far as that goes
  const TreeKernels* kernels = nullptr;     ///< one of tree_kernels(); nullptr: the fastest
  int threads = 1;  ///< of one sample, 1 .. ThreadTeam::kMost: the same bits with any number
};

/// What the strategy did, summed over all samples.
struct TreeCounts {
  BatchCounts batch;
  std::int64_t fronts = 0;             ///< of the tree
  std::int64_t factor_entries = 0;     ///< p (p + 1) / 2 + p q over all fronts
  std::int64_t entries_downdated = 0;  ///< read and written by downdates
  std::int64_t downdates = 0;          ///< of several bonds each
  std::int64_t responded = 0;          ///< breaks that TreeResponse named
  std::int64_t left = 0;               ///< samples that TreeResponse began and a factor went on with
  std::int64_t refactors = 0;          ///< asked for by a slack, a residual or a disagreement
  std::int64_t checked = 0;            ///< breaks compared with a full solve
  std::int64_t differences = 0;        ///< of these, another bond or state
  const char* kernels = "";            ///< instruction set
};

[[nodiscard]] std::unique_ptr<Equilibrium> make_equilibrium_tree(const Network& network,
                                                                 const EquilibriumOptions& options,
                                                                 PhaseTimes& times,
                                                                 const TreeOptions& tree = {});

/// The counts of a strategy that make_equilibrium_tree made; throws std::bad_cast for another one.
[[nodiscard]] TreeCounts tree_counts(const Equilibrium& equilibrium);

/// What `-equilibrium_tree_view` prints: several lines.
[[nodiscard]] std::string describe(const TreeCounts& counts);

}  // namespace crackle
