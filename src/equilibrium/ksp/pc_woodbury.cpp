#include "crackle/equilibrium/ksp/pc_woodbury.hpp"

#include <algorithm>
#include <vector>

#include "crackle/equilibrium/ksp/capacitance.hpp"
#include "crackle/equilibrium/ksp/pc_shell.hpp"

namespace crackle {

namespace {

constexpr const char* kType = "woodbury";
constexpr int kDefaultRank = 500;

struct Woodbury : MatrixFactor {
  std::vector<RankOne> removed;  ///< since the factor was made
  Capacitance capacitance;
  PetscInt rank = kDefaultRank;
  bool kept = false;    ///< the intact factor is to be had again
  bool intact = false;  ///< the factor is the one kept
  bool copied = false;  ///< it has a copy
  std::vector<double> load, solution, share;
  PcWoodburyCounts counts;
};

Woodbury& data(PC pc) {
  return pc_data<Woodbury>(pc);
}

void factor_now(PC pc) {
  Woodbury& woodbury = data(pc);
  if (woodbury.kept && woodbury.intact && !woodbury.copied) {
    woodbury.factor->keep();
    woodbury.copied = true;
  }
  woodbury.intact = false;
  woodbury.make(pc);
  PetscInt unknowns = 0;
  petsc::check(MatGetSize(pc->pmat, &unknowns, nullptr));
  woodbury.load.resize(static_cast<std::size_t>(unknowns));
  woodbury.solution.resize(woodbury.load.size());
  woodbury.removed.clear();
  woodbury.capacitance.clear();
  ++woodbury.counts.factorizations;
  woodbury.counts.null_pivots = static_cast<std::int64_t>(woodbury.factor->pinned().size());
  woodbury.counts.smallest_pivot = woodbury.factor->smallest_pivot();
  woodbury.counts.entries = woodbury.factor->entries();
}

double dot(const RankOne& w, std::span<const double> x) {
  double sum = 0;
  for (int i = 0; i < w.size; ++i) sum += w.value[i] * x[w.row[i]];
  return sum;
}

void add(const RankOne& w, double factor, std::span<double> x) {
  for (int i = 0; i < w.size; ++i) x[w.row[i]] += factor * w.value[i];
}

void solve(Woodbury& woodbury, std::span<const double> b, std::span<double> x) {
  woodbury.factor->solve(b, x);
  if (woodbury.removed.empty()) return;
  woodbury.share.clear();
  for (const RankOne& w : woodbury.removed) woodbury.share.push_back(dot(w, x));
  woodbury.capacitance.solve(woodbury.share);
  std::ranges::fill(woodbury.load, 0.0);
  for (std::size_t i = 0; i < woodbury.removed.size(); ++i) {
    add(woodbury.removed[i], woodbury.share[i], woodbury.load);
  }
  woodbury.factor->solve(woodbury.load, woodbury.solution);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += woodbury.solution[i];
}

PetscErrorCode set_up(PC pc) {
  return guarded(pc, kType, [pc] {
    if (!data(pc).is_current(pc)) factor_now(pc);
    pc->failedreason = data(pc).failure();
  });
}

PetscErrorCode apply(PC pc, Vec b, Vec x) {
  return guarded(pc, kType, [pc, b, x] {
    with_arrays(b, x, [pc](auto load, auto solution) { solve(data(pc), load, solution); });
  });
}

PetscErrorCode set_from_options(PC pc, PetscOptionItems* PetscOptionsObject) {
  PetscOptionsHeadBegin(PetscOptionsObject, "Options of -pc_type woodbury");
  PetscCall(PetscOptionsBoundedInt("-pc_woodbury_rank", "Breaks after which the matrix is factored anew", "",
                                   data(pc).rank, &data(pc).rank, nullptr, 1));
  PetscOptionsHeadEnd();
  return 0;
}

PetscErrorCode view(PC pc, PetscViewer viewer) {
  const PcWoodburyCounts& counts = data(pc).counts;
  return PetscViewerASCIIPrintf(
      viewer, "  CHOLMOD LDL^T of %lld entries, capacitance matrix of up to %d bonds, factorizations=%lld\n",
      static_cast<long long>(counts.entries), static_cast<int>(data(pc).rank),
      static_cast<long long>(counts.factorizations));
}

PetscErrorCode reset(PC pc) {
  data(pc).forget();
  data(pc).kept = data(pc).intact = data(pc).copied = false;
  return 0;
}

PetscErrorCode create(PC pc) {
  pc_create<Woodbury>(pc, set_up, apply, view);
  pc->ops->setfromoptions = set_from_options;
  pc->ops->reset = reset;
  return 0;
}

}  // namespace

PetscErrorCode register_pc_woodbury() {
  return PCRegister(kType, create);
}

bool is_pc_woodbury(PC pc) {
  return pc_has_type(pc, kType);
}

double pc_woodbury_remove(PC pc, const RankOne& w) {
  Woodbury& woodbury = data(pc);
  std::ranges::fill(woodbury.load, 0.0);
  add(w, 1, woodbury.load);
  woodbury.factor->solve(woodbury.load, woodbury.solution);
  woodbury.share.clear();
  for (const RankOne& earlier : woodbury.removed) woodbury.share.push_back(-dot(earlier, woodbury.solution));
  const double slack = woodbury.capacitance.grow(woodbury.share, 1 - dot(w, woodbury.solution));
  if (slack > 0) woodbury.removed.push_back(w);
  woodbury.note_state(pc);
  if (std::ssize(woodbury.removed) >= woodbury.rank) factor_now(pc);
  return slack;
}

bool pc_woodbury_refactor(PC pc) {
  factor_now(pc);
  return data(pc).definite;
}

void pc_woodbury_keep(PC pc) {
  data(pc).kept = data(pc).intact = true;
}

bool pc_woodbury_restore(PC pc) {
  Woodbury& woodbury = data(pc);
  woodbury.removed.clear();
  woodbury.capacitance.clear();
  if (!woodbury.intact && woodbury.copied) woodbury.intact = woodbury.factor->restore();
  woodbury.definite = woodbury.intact;
  if (woodbury.intact) {
    woodbury.note_state(pc);
  } else {
    woodbury.state = -1;
  }
  return woodbury.intact;
}

PcWoodburyCounts pc_woodbury_counts(PC pc) {
  PcWoodburyCounts counts = data(pc).counts;
  counts.rank = std::ssize(data(pc).removed);
  return counts;
}

}  // namespace crackle
