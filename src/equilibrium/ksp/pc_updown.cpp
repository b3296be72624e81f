#include "crackle/equilibrium/ksp/pc_updown.hpp"

#include <vector>

#include "crackle/equilibrium/ksp/pc_shell.hpp"

namespace crackle {

namespace {

constexpr const char* kType = "updown";

struct Updown : MatrixFactor {
  std::vector<RankOne> queue;           ///< breaks that K has and the factor has not
  PetscInt rank = 1;                    ///< how many of them start a downdate
  PetscBool both_sweeps = PETSC_FALSE;  ///< also where the forward sweep would find nothing but zeros
  PcUpdownCounts counts;
};

Updown& data(PC pc) {
  return pc_data<Updown>(pc);
}

void factor_now(PC pc) {
  Updown& updown = data(pc);
  updown.make(pc);
  updown.queue.clear();
  ++updown.counts.factorizations;
  updown.counts.null_pivots = static_cast<std::int64_t>(updown.factor->pinned().size());
  updown.counts.smallest_pivot = updown.factor->smallest_pivot();
  updown.counts.entries = updown.factor->entries();
}

PetscErrorCode set_up(PC pc) {
  return guarded(pc, kType, [pc] {
    if (!data(pc).is_current(pc)) factor_now(pc);
    pc->failedreason = data(pc).failure();
  });
}

PetscErrorCode apply(PC pc, Vec b, Vec x) {
  return guarded(pc, kType, [pc, b, x] {
    with_arrays(b, x, [pc](auto load, auto solution) {
      data(pc).factor->solve(load, solution, data(pc).both_sweeps == PETSC_TRUE);
    });
  });
}

PetscErrorCode set_from_options(PC pc, PetscOptionItems* PetscOptionsObject) {
  PetscOptionsHeadBegin(PetscOptionsObject, "Options of -pc_type updown");
  PetscCall(PetscOptionsBoundedInt("-pc_updown_rank", "Breaks that one downdate takes", "", data(pc).rank,
                                   &data(pc).rank, nullptr, 1));
  PetscCall(PetscOptionsBool("-pc_updown_both_sweeps",
                             "Forward sweep even where the load is the plate's alone", "",
                             data(pc).both_sweeps, &data(pc).both_sweeps, nullptr));
  PetscOptionsHeadEnd();
  return 0;
}

PetscErrorCode view(PC pc, PetscViewer viewer) {
  PetscBool ascii = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(viewer), PETSCVIEWERASCII, &ascii));
  if (ascii == PETSC_FALSE) return 0;
  const PcUpdownCounts& counts = data(pc).counts;
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  CHOLMOD LDL^T, METIS order, %lld entries, downdates of rank %d\n",
                                   static_cast<long long>(counts.entries), static_cast<int>(data(pc).rank)));
  PetscCall(PetscViewerASCIIPrintf(
      viewer, "  factorizations=%lld, downdates=%lld, bonds taken out=%lld, null pivots=%lld\n",
      static_cast<long long>(counts.factorizations), static_cast<long long>(counts.downdates),
      static_cast<long long>(counts.rank), static_cast<long long>(counts.null_pivots)));
  return 0;
}

PetscErrorCode reset(PC pc) {
  data(pc).forget();
  return 0;
}

PetscErrorCode create(PC pc) {
  pc_create<Updown>(pc, set_up, apply, view);
  pc->ops->setfromoptions = set_from_options;
  pc->ops->reset = reset;
  return 0;
}

}  // namespace

PetscErrorCode register_pc_updown() {
  return PCRegister(kType, create);
}

bool is_pc_updown(PC pc) {
  return pc_has_type(pc, kType);
}

int pc_updown_rank(PC pc) {
  return data(pc).rank;
}

double pc_updown_remove(PC pc, const RankOne& w) {
  Updown& updown = data(pc);
  updown.note_state(pc);
  updown.queue.push_back(w);
  if (std::ssize(updown.queue) < updown.rank) return 1;
  const double slack = updown.factor->downdate(updown.queue);
  ++updown.counts.downdates;
  updown.counts.rank += std::ssize(updown.queue);
  updown.queue.clear();
  return slack;
}

bool pc_updown_refactor(PC pc) {
  factor_now(pc);
  return data(pc).definite;
}

void pc_updown_keep(PC pc) {
  data(pc).factor->keep();
}

bool pc_updown_restore(PC pc) {
  Updown& updown = data(pc);
  updown.queue.clear();
  updown.definite = updown.factor != nullptr && updown.factor->restore();
  if (updown.definite) {
    updown.note_state(pc);
  } else {
    updown.state = -1;
  }
  return updown.definite;
}

PcUpdownCounts pc_updown_counts(PC pc) {
  return data(pc).counts;
}

}  // namespace crackle
