#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"

#include <algorithm>
#include <array>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/equilibrium/ksp/pc_circulant.hpp"
#include "crackle/equilibrium/ksp/pc_updown.hpp"
#include "crackle/equilibrium/ksp/pc_woodbury.hpp"

namespace crackle {

namespace {

template <auto own_counts>
PreconditionerCounts counts_by(PC pc) {
  const auto counts = own_counts(pc);
  return {counts.factorizations, counts.null_pivots, counts.entries, counts.smallest_pivot};
}

constexpr std::array kKinds = {
    PreconditionerKind{.make_known = register_pc_updown,
                       .is = is_pc_updown,
                       .follows = true,
                       .rank = pc_updown_rank,
                       .remove = pc_updown_remove,
                       .renew = pc_updown_refactor,
                       .keep = pc_updown_keep,
                       .restore = pc_updown_restore,
                       .counts = counts_by<pc_updown_counts>},
    PreconditionerKind{.make_known = register_pc_woodbury,
                       .is = is_pc_woodbury,
                       .follows = true,
                       .remove = pc_woodbury_remove,
                       .renew = pc_woodbury_refactor,
                       .keep = pc_woodbury_keep,
                       .restore = pc_woodbury_restore,
                       .counts = counts_by<pc_woodbury_counts>},
    PreconditionerKind{.make_known = register_pc_circulant,
                       .is = is_pc_circulant,
                       .begin = pc_circulant_set_network,
                       .counts = [](PC) { return PreconditionerCounts{.factorizations = 1}; }},
};

constexpr PreconditionerKind kPetscs{.is_ours = false};

}  // namespace

const PreconditionerKind& kind_of(PC pc) {
  const auto* const kind = std::ranges::find_if(kKinds, [pc](const auto& row) { return row.is(pc); });
  return kind == kKinds.end() ? kPetscs : *kind;
}

void register_preconditioners() {
  for (const PreconditionerKind& kind : kKinds) petsc::check(kind.make_known());
}

}  // namespace crackle
