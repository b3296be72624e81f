#include "crackle/equilibrium/ksp/equilibrium_ksp.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>

#include "crackle/base/error.hpp"
#include "crackle/base/option_database.hpp"
#include "crackle/base/ranks.hpp"
#include "crackle/equilibrium/held_solver.hpp"
#include "crackle/equilibrium/ksp/preconditioner.hpp"
#include "crackle/equilibrium/ksp/solver_quirks.hpp"
#include "crackle/network/network_matrix.hpp"

namespace crackle {

namespace {

using petsc::check;

/// A downdate with a slack below this is not trusted: it loses as many digits as the slack has zeros.
constexpr double kSmallSlack = 1e-8;
/// Relative rounding to expect in a slack, next to which a computed one says no more.
constexpr double kSlackRounding = 1e-12;
/// A slack below this, and every kCheckEvery-th break, has the residual measured.
constexpr double kDoubtfulSlack = 1e-4;
constexpr std::int64_t kCheckEvery = 64;
/// Defaults of -ksp_rtol, tight enough that iterative solvers break the same bonds, and of -ksp_divtol and
/// -ksp_max_it: near failure a residual grows by the root of the condition number before it falls.
constexpr double kDefaultTolerance = 1e-12;
constexpr double kDefaultDivergence = 1e20;
constexpr int kDefaultIterations = 100000;
/// A factor of one's own costs 30 breaks; a solver that starts afresh at every break hardly notices another start.
constexpr std::int64_t kBreaksWorthSettlingUpdown = 2500;
constexpr std::int64_t kBreaksWorthSettling = 100;

/// An error whose message has the value of a solver's option is put down to that option.
void check_options(PetscErrorCode code) {
  if (code == 0) return;
  const std::string option = option_named_in(petsc::last_message());
  if (option.empty()) check(code);
  throw InputError(option + ": " + petsc::last_message());
}

class EquilibriumKsp final : public Equilibrium, private HeldFactor {
 public:
  EquilibriumKsp(const Network& network, const EquilibriumOptions& options, PhaseTimes& times,
                 const KspOptions& ksp);
  [[nodiscard]] EquilibriumCounts counts() const override;
  [[nodiscard]] std::int64_t breaks_worth_settling() const override {
    return follows_ ? kBreaksWorthSettlingUpdown : kBreaksWorthSettling;
  }

 private:
  void do_reset() override;
  void do_remove(BondId bond) override;
  void do_settle() override;
  void do_resume(std::span<const BondId> bonds) override;
  [[nodiscard]] State search(Critical& next) override;
  [[nodiscard]] std::span<const double> do_displacements() override;
  [[nodiscard]] bool iterates() const override { return !preonly_; }
  [[nodiscard]] bool is_foreign() const override { return !follows_; }
  [[nodiscard]] double smallest_pivot() override;
  [[nodiscard]] HeldFactor* held_factor() override { return follows_ ? this : nullptr; }
  [[nodiscard]] bool move_plate(std::span<double> u) override;
  [[nodiscard]] std::size_t held_pins() const override {
    return static_cast<std::size_t>(preconditioner_->counts().null_pivots);
  }
  void follow(BondId /*bond*/) override { behind_ = true; }
  [[nodiscard]] bool renew() override;
  void create_solver();
  /// Fills u_; `failed`, with a complaint_, when the solver gives up.
  [[nodiscard]] State solve();
  [[nodiscard]] State iterate();
  [[nodiscard]] State give_up(const std::string& why);
  void gather();
  void downdate(BondId bond);
  [[nodiscard]] bool has_softened() const;
  [[nodiscard]] State check_downdates();
  [[nodiscard]] double measure_residual();

  int refactor_every_;
  bool
      together_;  ///< several processes share the matrix; each has all displacements, and comes to the same ends
  MPI_Comm comm_;
  NetworkMatrix matrix_;
  petsc::VecHandle load_, u_;
  petsc::VecHandle all_u_;  ///< with together_: u_ whole
  petsc::ScatterHandle scatter_;
  petsc::KspHandle ksp_;
  std::unique_ptr<Preconditioner> preconditioner_;
  std::int64_t earlier_set_ups_ = 0;  ///< of the preconditioners before this one
  bool follows_ = false;              ///< the preconditioner is a factor that follows the breaks
  bool preonly_ = false;
  bool loose_ = false;  ///< the last break left nothing that carries, or not enough for double
  bool check_due_ = false;
  bool behind_ = false;            ///< the Referee has taken over: breaks are no longer taken in
  bool kept_ = false;              ///< the intact factor has a copy
  PreconditionerCounts intact_;    ///< what is known of the intact network's factor
  std::vector<BondId> removed_;    ///< since reset
  std::vector<double> workspace_;  ///< [n] of the residual
};

EquilibriumKsp::EquilibriumKsp(const Network& network, const EquilibriumOptions& options, PhaseTimes& times,
                               const KspOptions& ksp)
    : Equilibrium(network, options, times),
      refactor_every_(ksp.refactor_every),
      together_(options.ranks != nullptr && options.ranks->group_size() > 1),
      comm_(together_ ? options.ranks->group() : PETSC_COMM_SELF),
      matrix_(network, comm_) {
  check(MatCreateVecs(matrix_.get(), u_.out(), load_.out()));
  if (together_) check(VecScatterCreateToAll(u_, scatter_.out(), all_u_.out()));
  check(VecSetValue(load_, network.plate, 1.0, INSERT_VALUES));
  check(VecAssemblyBegin(load_));
  check(VecAssemblyEnd(load_));
  create_solver();
  counts_.unknowns = network.unknowns;
  // the intact factor, at once: solvers read the last of their options here. A singular matrix shows again,
  // and is told, in the first solve.
  const PhaseScope scope(times, Phase::factor);
  const PetscErrorCode code = preconditioner_->set_up();
  if (code != PETSC_ERR_MAT_CH_ZRPVT) check_options(code);
  intact_ = preconditioner_->counts();
}

double EquilibriumKsp::smallest_pivot() {
  return intact_.null_pivots > 0 ? 0 : intact_.smallest_pivot;
}

/// A new one in place of any other: many keep something of the matrices that they have seen, an ordering or a hierarchy.
void EquilibriumKsp::create_solver() {
  if (preconditioner_) earlier_set_ups_ += preconditioner_->counts().factorizations;
  ksp_ = {};
  check(KSPCreate(comm_, ksp_.out()));
  check(KSPSetOperators(ksp_, matrix_.get(), matrix_.get()));
  PC pc = nullptr;
  check(KSPGetPC(ksp_, &pc));
  check(KSPSetType(ksp_, KSPPREONLY));
  check(PCSetType(pc, together_ ? PCCHOLESKY : "updown"));
  if (together_) check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  check(KSPSetTolerances(ksp_, kDefaultTolerance, PETSC_DEFAULT, kDefaultDivergence, kDefaultIterations));
  check_options(KSPSetFromOptions(ksp_));
  find_null_pivots(pc);
  preconditioner_ = std::make_unique<Preconditioner>(ksp_, network_, refactor_every_);
  follows_ = preconditioner_->follows();
  if (!follows_) matrix_.hold_loose();
  KSPType type = nullptr;
  check(KSPGetType(ksp_, &type));
  preonly_ = std::string_view(type) == KSPPREONLY;
  if (std::string_view(type) == KSPCHEBYSHEV) {
    throw InputError("-ksp_type", "chebyshev",
                     "a method that finds the range of eigenvalues itself: cg, minres, ...");
  }
  if (together_ && preconditioner_->is_ours()) {
    PCType pc_type = nullptr;
    check(PCGetType(pc, &pc_type));
    throw InputError("-pc_type", std::string(pc_type) + " with -ensemble_ranks_per_sample above 1",
                     "a solver for several processes: cholesky (by MUMPS), gamg, hypre, ...");
  }
}

void EquilibriumKsp::do_reset() {
  check(VecZeroEntries(u_));
  loose_ = false;
  check_due_ = false;
  behind_ = false;
  if (removed_.empty()) return;
  {
    const PhaseScope scope(times_, Phase::assembly);
    matrix_.update(removed_, broken());
    removed_.clear();
  }
  const PhaseScope scope(times_, Phase::factor);
  if (preconditioner_->is_ours()) {
    preconditioner_->restore();
  } else {
    create_solver();
  }
}

void EquilibriumKsp::do_settle() {
  check(VecZeroEntries(u_));
  check_due_ = false;
  const PhaseScope scope(times_, Phase::factor);
  if (preconditioner_->is_ours()) {
    loose_ = !preconditioner_->renew();
  } else {
    create_solver();
  }
}

void EquilibriumKsp::do_resume(std::span<const BondId> bonds) {
  const PhaseScope scope(times_, Phase::assembly);
  removed_.assign(bonds.begin(), bonds.end());
  matrix_.update(bonds, broken());
}

void EquilibriumKsp::do_remove(BondId bond) {
  removed_.push_back(bond);
  {
    const PhaseScope scope(times_, Phase::assembly);
    matrix_.update({&bond, 1}, broken());
  }
  downdate(bond);
}

/// F after the break follows from F before it, the bond's force f at unit plate load and the slack s:
/// 1/F' = 1/F + f^2 / (k s) (Sherman-Morrison), so that the largest s that rounding allows bounds F'.
void EquilibriumKsp::downdate(BondId bond) {
  const RankOne w = break_change(network_, bond);
  double slack = 1;
  {
    const PhaseScope scope(times_, Phase::downdate);
    slack = preconditioner_->remove(w);
  }
  if (!follows_) return;
  if (preconditioner_->rank() == 1) {
    const auto u = do_displacements();
    const double k = network_.stiffness[bond];
    const double force = k * elongation(network_, bond, u);
    const double most =
        1 / (u[network_.plate] + force * force / (k * (std::max(slack, 0.0) + kSlackRounding)));
    loose_ = most < kRefereedStiffness * intact_stiffness();
    if (loose_) return;
  }
  counts_.smallest_slack = std::min(counts_.smallest_slack, slack);
  check_due_ = slack < kDoubtfulSlack || std::ssize(removed_) % kCheckEvery == 0;
  if (slack >= kSmallSlack) return;
  loose_ = !renew() || has_softened();
}

/// Breaks make no new null pivot, since a bond that carries force holds no motion alone.
bool EquilibriumKsp::has_softened() const {
  const PreconditionerCounts now = preconditioner_->counts();
  return now.null_pivots > intact_.null_pivots || now.smallest_pivot < kSoftPivot;
}

/// An iteration that gives up on an old preconditioner tries a new one.
State EquilibriumKsp::solve() {
  const State state = iterate();
  if (state == State::carrying || !preconditioner_->lags()) return state;
  complaint_.clear();
  return renew() ? iterate() : State::failed;
}

State EquilibriumKsp::iterate() {
  PetscErrorCode code = 0;
  {
    const PhaseScope scope(times_, Phase::factor);
    code = preconditioner_->set_up();
    if (!kept_ && options_.many_samples && removed_.empty() && code == 0) {
      preconditioner_->keep();
      kept_ = true;
    }
    // an unknown that was pinned though something holds it shows in the residual
    if (removed_.empty() && preconditioner_->counts().null_pivots > 0) check_due_ = true;
  }
  PC pc = nullptr;
  check(KSPGetPC(ksp_, &pc));
  PCFailedReason failed = PC_NOERROR;
  if (code == 0) check(PCGetFailedReason(pc, &failed));
  if (failed != PC_NOERROR) {
    const State state = give_up("the preconditioner could not be set up" + mumps_error(pc));
    // no singular matrix does that: the solver lacks something
    return failed == PC_FACTOR_OUTMEMORY || failed == PC_FACTOR_OTHER ? State::unsolved : state;
  }
  if (code == 0) {
    const PhaseScope scope(times_, Phase::solve);
    code = KSPSolve(ksp_, load_, u_);
  }
  // many answer a singular matrix with an error; of the intact one it is the user's to know
  if (code != 0 && code != PETSC_ERR_MAT_CH_ZRPVT && removed_.empty()) check(code);
  if (code != 0) {
    forget_hypre_errors();
    return give_up(petsc::last_message());
  }
  gather();
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(ksp_, &reason));
  PetscInt iterations = 0;
  check(KSPGetIterationNumber(ksp_, &iterations));
  counts_.iterations += iterations;
  if (reason > 0) return State::carrying;
  return give_up(std::string("the solver stopped with ") + KSPConvergedReasons[reason]);
}

/// It may have met the end of the network or its own.
State EquilibriumKsp::give_up(const std::string& why) {
  complaint_ = why;
  return State::failed;
}

/// Half a solve by a factor that follows: where F is lost in rounding, the displacements relative to the plate's are not.
bool EquilibriumKsp::move_plate(std::span<double> u) {
  if (behind_ || KSPSolve(ksp_, load_, u_) != 0) return false;
  std::ranges::copy(do_displacements(), u.begin());
  const double plate = u[network_.plate];
  for (double& x : u) x /= plate;
  return std::isfinite(plate) && plate != 0;
}

/// Every process gets all displacements.
void EquilibriumKsp::gather() {
  if (!together_) return;
  check(VecScatterBegin(scatter_, u_, all_u_, INSERT_VALUES, SCATTER_FORWARD));
  check(VecScatterEnd(scatter_, u_, all_u_, INSERT_VALUES, SCATTER_FORWARD));
}

double EquilibriumKsp::measure_residual() {
  workspace_.resize(static_cast<std::size_t>(network_.unknowns));
  const double error = backward_error(network_, broken(), do_displacements(), workspace_);
  check_due_ = false;
  return error;
}

/// Replaces a downdated factor whose residual has grown, once.
State EquilibriumKsp::check_downdates() {
  double error = measure_residual();
  if (!(error <= kLargestError)) {
    if (!renew()) return State::failed;
    const State state = solve();
    if (state != State::carrying) return state;
    error = measure_residual();
  }
  if (!(error <= kLargestError)) return State::failed;
  counts_.largest_residual = std::max(counts_.largest_residual, error);
  return State::carrying;
}

bool EquilibriumKsp::renew() {
  const PhaseScope scope(times_, Phase::factor);
  ++counts_.refactors;
  return preconditioner_->renew();
}

State EquilibriumKsp::search(Critical& next) {
  if (loose_) return State::failed;
  State state = solve();
  if (state == State::carrying && check_due_) state = check_downdates();
  if (state != State::carrying) return state;
  const PhaseScope scope(times_, Phase::search);
  const auto u = do_displacements();
  if (has_failed(1 / u[network_.plate])) return State::failed;
  return scan(u, next);
}

std::span<const double> EquilibriumKsp::do_displacements() {
  const PetscScalar* u = nullptr;
  Vec whole = together_ ? all_u_ : u_;
  check(VecGetArrayRead(whole, &u));
  const std::span<const double> view(u, static_cast<std::size_t>(network_.unknowns));
  check(VecRestoreArrayRead(whole, &u));
  return view;
}

EquilibriumCounts EquilibriumKsp::counts() const {
  EquilibriumCounts counts = counts_;
  const PreconditionerCounts made = preconditioner_->counts();
  counts.factorizations = earlier_set_ups_ + made.factorizations;
  counts.null_pivots = made.null_pivots;
  counts.factor_entries = made.entries;
  return counts;
}

}  // namespace

std::unique_ptr<Equilibrium> make_equilibrium_ksp(const Network& network, const EquilibriumOptions& options,
                                                  PhaseTimes& times, const KspOptions& ksp) {
  return std::make_unique<EquilibriumKsp>(network, options, times, ksp);
}

}  // namespace crackle
