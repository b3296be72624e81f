/// What surrounds the solver, and what refactoring costs: ratios of two things timed in turn in one run.
///
///   OPENBLAS_NUM_THREADS=1 build/release/tests/benchmark/benchmark_strategies --benchmark_repetitions=5
///
/// AgainstBare/L      seconds per break of `updown` (matrix, downdate, solve, check, search) over those of
/// bare
///                    cholmod_updown + cholmod_solve2 (system A; DLt: no forward sweep) on the same breaks
/// Samples/L/samples, Stretch/L/skipped/timed   seconds of `updown`, of `updown` with both sweeps (the paper's
///                    algorithm), and of bare CHOLMOD with both, over those of `tree`: whole samples, part of one
/// Refactoring/...    seconds per break of a refactoring solver over those of `updown`
/// StartUp            wall time of `crackle -lattice_size 8 -stop breaks=1`, a process of its own

#include <benchmark/benchmark.h>
#include <cholmod.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/equilibrium/equilibrium.hpp"
#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/network/matrix_rows.hpp"
#include "crackle/network/network_matrix.hpp"

extern char** environ;

namespace {

using namespace crackle;  // NOLINT(*-using-namespace): one file, one purpose
using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::unique_ptr<Equilibrium> start(const Network& network, const std::string& petsc_options,
                                   PhaseTimes& times, const char* strategy = "ksp") {
  petsc::check(PetscOptionsInsertString(nullptr, petsc_options.c_str()));
  ChosenStrategy options;
  options.strategy = strategy;
  auto equilibrium = make_equilibrium(network, options, times);
  petsc::check(PetscOptionsClear(nullptr));
  std::vector<double> threshold(network.lattice.bond.size());
  draw_uniform_thresholds(1, 0, threshold);
  equilibrium->reset(threshold);
  return equilibrium;
}

/// One break: search, downdate, and what lies between.
BondId break_once(Equilibrium& equilibrium) {
  Critical next;
  if (equilibrium.find_critical(next) != State::carrying) return -1;
  equilibrium.remove(next.bond);
  return next.bond;
}

/// CHOLMOD with nothing around it, set up as its users would: METIS, supernodal, then simplicial
/// LDL^T.
class Bare {
 public:
  explicit Bare(const Network& network) : network_(network) {
    cholmod_start(&common_);
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_METIS;
    common_.final_ll = 0;
    common_.final_super = 0;
    common_.final_asis = 0;
    common_.final_resymbol = 1;
    const NetworkMatrix matrix(network);
    const MatrixRows view(matrix.get());
    const auto [n, first, column, value] = view.rows();
    cholmod_sparse K{};
    K.nrow = K.ncol = static_cast<std::size_t>(n);
    K.nzmax = static_cast<std::size_t>(first[n]);
    K.p = const_cast<int*>(first);
    K.i = const_cast<int*>(column);
    K.x = const_cast<double*>(value);
    K.stype = 1;
    K.itype = CHOLMOD_INT;
    K.xtype = CHOLMOD_REAL;
    K.sorted = K.packed = 1;
    factor_ = cholmod_analyze(&K, &common_);
    cholmod_factorize(&K, factor_, &common_);
    load_ = cholmod_zeros(K.nrow, 1, CHOLMOD_REAL, &common_);
    static_cast<double*>(load_->x)[n - 1] = 1;
    change_ = cholmod_allocate_sparse(K.nrow, 1, 4, 1, 1, 0, CHOLMOD_REAL, &common_);
    position_.resize(K.nrow);
    for (int i = 0; i < n; ++i) position_[static_cast<int*>(factor_->Perm)[i]] = i;
  }
  ~Bare() {
    for (cholmod_dense** dense : {&load_, &x_, &y_, &e_}) cholmod_free_dense(dense, &common_);
    cholmod_free_sparse(&change_, &common_);
    cholmod_free_factor(&factor_, &common_);
    cholmod_finish(&common_);
  }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;

  void solve(int system) {
    cholmod_solve2(system, factor_, load_, nullptr, &x_, nullptr, &y_, &e_, &common_);
    benchmark::DoNotOptimize(x_->x);
  }

  void remove(BondId bond) {
    std::vector<std::pair<int, double>> entries;
    for (std::size_t i = 0; i < network_.bond_dofs(bond).size(); ++i) {
      if (network_.bond_values(bond)[i] == 0) continue;
      entries.emplace_back(position_[network_.bond_dofs(bond)[i]], network_.bond_values(bond)[i]);
    }
    std::sort(entries.begin(), entries.end());
    static_cast<int*>(change_->p)[1] = static_cast<int>(entries.size());
    for (std::size_t i = 0; i < entries.size(); ++i) {
      static_cast<int*>(change_->i)[i] = entries[i].first;
      static_cast<double*>(change_->x)[i] = entries[i].second;
    }
    cholmod_updown(0, change_, factor_, &common_);
  }

 private:
  const Network& network_;
  cholmod_common common_{};
  cholmod_factor* factor_ = nullptr;
  cholmod_dense *load_ = nullptr, *x_ = nullptr, *y_ = nullptr, *e_ = nullptr;
  cholmod_sparse* change_ = nullptr;
  std::vector<int> position_;
};

/// Chunks of breaks, the three sides in turn, so that a change of the machine's speed meets all alike.
void against_bare(benchmark::State& state) {
  constexpr int kChunk = 20;
  const auto size = static_cast<int>(state.range(0));
  const Network network = make_network(triangular_lattice(size, 1), Model::spring, Grips::sliding, {});
  PhaseTimes times;
  const auto updown = start(network, "", times);
  Bare full(network);
  Bare half(network);
  double ours = 0;
  double bare = 0;
  double bare_half = 0;
  int breaks = 0;
  for ([[maybe_unused]] auto _ : state) {
    std::vector<BondId> bonds;
    auto begin = Clock::now();
    for (int i = 0; i < kChunk; ++i) bonds.push_back(break_once(*updown));
    const double mine = since(begin);
    ours += mine;
    begin = Clock::now();
    for (const BondId bond : bonds) {
      full.solve(CHOLMOD_A);
      full.remove(bond);
    }
    bare += since(begin);
    begin = Clock::now();
    for (const BondId bond : bonds) {
      half.solve(CHOLMOD_DLt);
      half.remove(bond);
    }
    bare_half += since(begin);
    breaks += kChunk;
    state.SetIterationTime(mine);
  }
  state.counters["ms_per_break"] = 1e3 * ours / breaks;
  state.counters["over_bare_A"] = ours / bare;
  state.counters["over_bare_DLt"] = ours / bare_half;
}
BENCHMARK(against_bare)->Name("AgainstBare")->Arg(64)->Arg(128)->UseManualTime()->Iterations(30);

/// The tree and what it is measured against: `updown` without and with the forward sweep, and bare CHOLMOD with it,
/// which sums no forces.
class Rivals {
 public:
  explicit Rivals(int size)
      : network_(make_network(triangular_lattice(size, 1), Model::spring, Grips::sliding, {})),
        tree_(start(network_, "", times_, "tree")),
        updown_(start(network_, "", times_)),
        full_(start(network_, "-pc_updown_both_sweeps", times_)),
        bare_(std::make_unique<Bare>(network_)) {}

  /// A whole sample, each side in turn.
  void break_sample(std::int64_t sample) {
    std::vector<double> threshold(network_.lattice.bond.size());
    draw_uniform_thresholds(1, sample, threshold);
    bare_ = std::make_unique<Bare>(network_);
    std::vector<BondId> bonds;
    time(0, [&] {
      tree_->reset(threshold);
      for (BondId bond = break_once(*tree_); bond >= 0; bond = break_once(*tree_)) bonds.push_back(bond);
    });
    for (const auto& [side, rival] : {std::pair{1, updown_.get()}, std::pair{2, full_.get()}}) {
      time(side, [&] {
        rival->reset(threshold);
        follow(*rival, bonds);
        differs_ = differs_ || break_once(*rival) >= 0;
      });
    }
    time(3, [&] { follow(bonds); });
    breaks_ += static_cast<int>(bonds.size());
  }

  /// The next `count` breaks of a sample; not timed: the sides have but to get there.
  void break_some(int count, bool timed) {
    std::vector<BondId> bonds;
    const auto before = seconds_;
    time(0, [&] {
      for (int i = 0; i < count; ++i) bonds.push_back(break_once(*tree_));
    });
    if (timed) {
      time(1, [&] { follow(*updown_, bonds); });
      time(2, [&] { follow(*full_, bonds); });
      time(3, [&] { follow(bonds); });
      breaks_ += count;
      return;
    }
    for (const BondId bond : bonds) {
      updown_->remove(bond);
      full_->remove(bond);
      bare_->remove(bond);
    }
    seconds_ = before;
  }

  void report(benchmark::State& state) const {
    if (differs_) state.SkipWithError("another bond");
    state.SetIterationTime(seconds_[0]);
    state.counters["ms_per_break"] = 1e3 * seconds_[0] / breaks_;
    state.counters["updown_over_tree"] = seconds_[1] / seconds_[0];
    state.counters["both_sweeps_over_tree"] = seconds_[2] / seconds_[0];
    state.counters["bare_A_over_tree"] = seconds_[3] / seconds_[0];
  }

 private:
  template <class Act>
  void time(int side, Act act) {
    const auto begin = Clock::now();
    act();
    seconds_[side] += since(begin);
  }
  void follow(Equilibrium& equilibrium, std::span<const BondId> bonds) {
    for (const BondId bond : bonds) differs_ = differs_ || break_once(equilibrium) != bond;
  }
  void follow(std::span<const BondId> bonds) {
    for (const BondId bond : bonds) {
      bare_->solve(CHOLMOD_A);
      bare_->remove(bond);
    }
  }

  Network network_;
  PhaseTimes times_;
  std::unique_ptr<Equilibrium> tree_;
  std::unique_ptr<Equilibrium> updown_;
  std::unique_ptr<Equilibrium> full_;
  std::unique_ptr<Bare> bare_;
  std::array<double, 4> seconds_{};
  int breaks_ = 0;
  bool differs_ = false;
};

void tree_samples(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) {
    Rivals rivals(static_cast<int>(state.range(0)));
    for (std::int64_t sample = 0; sample < state.range(1); ++sample) rivals.break_sample(sample);
    rivals.report(state);
  }
}
BENCHMARK(tree_samples)
    ->Name("Samples")
    ->ArgNames({"L", "samples"})
    ->Args({8, 200})
    ->Args({16, 50})
    ->Args({32, 20})
    ->Args({64, 4})
    ->Args({128, 1})
    ->UseManualTime()
    ->Iterations(1);

/// Chunks of breaks, so that a change of the machine's speed meets all sides alike.
void tree_stretch(benchmark::State& state) {
  constexpr int kChunk = 100;
  for ([[maybe_unused]] auto _ : state) {
    Rivals rivals(static_cast<int>(state.range(0)));
    for (int done = 0; done < state.range(1); done += kChunk) rivals.break_some(kChunk, false);
    for (int done = 0; done < state.range(2); done += kChunk) rivals.break_some(kChunk, true);
    rivals.report(state);
  }
}
BENCHMARK(tree_stretch)
    ->Name("Stretch")
    ->ArgNames({"L", "skipped", "timed"})
    ->Args({256, 0, 500})
    ->Args({256, 8300, 500})
    ->UseManualTime()
    ->Iterations(1);

/// A refactoring solver and `updown` on the same breaks, in turn.
void refactoring(benchmark::State& state, const char* petsc_options) {
  constexpr int kChunk = 5;
  const auto size = static_cast<int>(state.range(0));
  const Network network = make_network(triangular_lattice(size, 1), Model::spring, Grips::sliding, {});
  PhaseTimes times;
  const auto updown = start(network, "", times);
  const auto other = start(network, petsc_options, times);
  double ours = 0;
  double theirs = 0;
  int breaks = 0;
  for ([[maybe_unused]] auto _ : state) {
    auto begin = Clock::now();
    for (int i = 0; i < kChunk; ++i) break_once(*updown);
    ours += since(begin);
    begin = Clock::now();
    for (int i = 0; i < kChunk; ++i) break_once(*other);
    const double taken = since(begin);
    theirs += taken;
    breaks += kChunk;
    state.SetIterationTime(taken);
  }
  state.counters["ms_per_break"] = 1e3 * theirs / breaks;
  state.counters["over_updown"] = theirs / ours;
}
constexpr const char* kMumps = "-pc_type cholesky -pc_factor_mat_solver_type mumps -mat_mumps_icntl_24 1";
constexpr const char* kCholmod = "-pc_type cholesky -pc_factor_mat_solver_type cholmod";
BENCHMARK_CAPTURE(refactoring, mumps, kMumps)->Arg(64)->Arg(128)->UseManualTime()->Iterations(10);
BENCHMARK_CAPTURE(refactoring, cholmod, kCholmod)->Arg(64)->Arg(128)->UseManualTime()->Iterations(10);

/// From exec to exit, through the first break.
void start_up(benchmark::State& state) {
  const std::string output = (std::filesystem::temp_directory_path() / "crackle_start_up.h5").string();
  const char* words[] = {CRACKLE_PROGRAM, "-lattice_size", "8",       "-stop",        "breaks=1", "-monitor",
                         "none",          "-overwrite",    "-output", output.c_str(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", 1 /* O_WRONLY */, 0);
  for ([[maybe_unused]] auto _ : state) {
    const auto begin = Clock::now();
    pid_t child = 0;
    int status = -1;
    posix_spawn(&child, CRACKLE_PROGRAM, &actions, nullptr, const_cast<char**>(words), environ);
    waitpid(child, &status, 0);
    if (status != 0) state.SkipWithError("the program failed");
    state.SetIterationTime(since(begin));
  }
  posix_spawn_file_actions_destroy(&actions);
  std::filesystem::remove(output);
}
BENCHMARK(start_up)->Name("StartUp")->UseManualTime()->Iterations(20)->Unit(benchmark::kMillisecond);

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const petsc::Session session(argc, argv, nullptr);
  register_preconditioners();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
