#include "crackle/equilibrium/tree/equilibrium_tree.hpp"

#include <algorithm>
#include <cmath>

#include "crackle/base/memory.hpp"
#include "crackle/equilibrium/held_solver.hpp"
#include "crackle/equilibrium/tree/tree_factor.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/equilibrium/tree/tree_response.hpp"

namespace crackle {

namespace {

/// Below this slack a downdate has lost too many digits (about -log10 of it): refactor.
constexpr double kLeastSlack = 1e-6;
/// Breaks between two looks at the backward error.
constexpr std::int64_t kBreaksPerCheck = 500;
/// Entries of a factor that is copied, to be restored for the next sample. A larger one (L = 256) is made anew: 1 %
/// of a sample's time for a third of its memory.
constexpr std::int64_t kMostKept = 4'000'000;
/// A factorization takes as long as half a break for each row of nodes (L = 256: 125 breaks, 512: 240). Samples of
/// fewer breaks than this take less than half a minute.
constexpr double kBreaksPerRow = 25;
constexpr double kBreaksOfShortSample = 10'000;

SeparatorTree make_affordable_tree(const Network& network, const TreeOptions& options) {
  SeparatorTree tree = make_separator_tree(network, options.dissection);
  const bool single = options.precision == Precision::single;
  demand_memory(
      "-equilibrium tree of " + std::to_string(network.unknowns) + " unknowns",
      static_cast<double>(sizeof(double) * tree.block_entries) + (single ? TreeSingle::bytes(tree) : 0));
  return tree;
}

class EquilibriumTree final : public Equilibrium, private HeldFactor {
 public:
  EquilibriumTree(const Network& network, const EquilibriumOptions& options, PhaseTimes& times,
                  const TreeOptions& tree)
      : Equilibrium(network, options, times),
        tree_(make_affordable_tree(network, tree)),
        bonds_(make_tree_bonds(network, tree_)),
        kernels_(tree.kernels != nullptr ? *tree.kernels : *tree_kernels().front()),
        scratch_(tree_, tree.threads),
        factor_(tree_, bonds_, kernels_, options.many_samples && tree_.factor_entries <= kMostKept, scratch_),
        batch_(network, tree_, bonds_, factor_, kernels_, options.break_on, tree.precision, scratch_, times),
        responds_(tree.responses && TreeResponse::is_worthwhile(network)),
        displacement_(network.unknowns),
        residual_(network.unknowns) {
    if (tree.verify) checker_ = std::make_unique<TreeFactor>(tree_, bonds_, kernels_, false, scratch_);
    counts_.unknowns = network.unknowns;
    counts_.factor_entries = tree_.factor_entries;
  }

  [[nodiscard]] std::int64_t breaks_worth_settling() const override {
    const double rows = std::sqrt(static_cast<double>(network_.unknowns) / network_.components);
    return std::llround(std::max(kBreaksOfShortSample, kBreaksPerRow * rows));
  }

  [[nodiscard]] EquilibriumCounts counts() const override {
    EquilibriumCounts counts = counts_;
    counts.factorizations = factor_.factorizations();
    counts.null_pivots = intact_pivots_.null;
    return counts;
  }

  [[nodiscard]] TreeCounts tree_counts() const {
    TreeCounts counts = tree_counts_;
    counts.batch = batch_.counts();
    counts.fronts = tree_.fronts();
    counts.factor_entries = tree_.factor_entries;
    counts.entries_downdated = factor_.entries_updated();
    counts.refactors = counts_.refactors;
    counts.kernels = kernels_.name;
    return counts;
  }

 protected:
  [[nodiscard]] std::span<const double> do_displacements() override {
    if (responding_) {
      response_->get_displacements(shown_, displacement_);
    } else if (unsolved_ || !batch_.copy_state(shown_, displacement_)) {
      // the factor is the network's own once it has taken everything in
      factor_.solve_plate(displacement_);
    }
    return displacement_;
  }

  /// Of the intact network: asked for before anything has broken, or just after restoring it.
  [[nodiscard]] double smallest_pivot() override {
    return intact_pivots_.null > 0 ? 0 : intact_pivots_.smallest;
  }

  [[nodiscard]] HeldFactor* held_factor() override { return this; }

  [[nodiscard]] State search(Critical& next) override {
    if (responding_ && head_ == response_->verified().size() && state_ == State::carrying) respond();
    if (!responding_ && head_ == batch_.verified().size() && state_ == State::carrying) advance();
    if (state_ == State::carrying) {
      shown_ = static_cast<int>(head_);
      next = responding_ ? responded() : confirmed();
    }
    if (checker_) check(next);
    return state_;
  }

  bool renew() override {
    if (responding_) leave_response();
    refactor();
    head_ = batch_.verified().size();
    return true;
  }

  void do_reset() override {
    if (!is_intact_) {
      const PhaseScope scope(times_, Phase::factor);
      factor_.restore();
      is_intact_ = true;
      intact_pivots_ = factor_.pivots();
      if (!response_ && responds_) make_response();
    }
    responding_ = responds_ && response_->reset(threshold());
    if (!responding_) return start_from_factor();
    begin();
  }

  void do_settle() override {
    {
      const PhaseScope scope(times_, Phase::factor);
      factor_.factorize(broken());
    }
    start_from_factor();
  }

  void do_remove(BondId bond) override {
    if (responding_) {
      const auto ahead = response_->verified();
      if (head_ < ahead.size() && ahead[head_].bond == bond) {
        slack_ = ahead[head_++].slack;
        ++tree_counts_.responded;
        if (slack_ >= kLeastPredictedSlack) note(slack_);
      } else {
        leave_response();
      }
      return;
    }
    batch_.remove(bond);
    const auto verified = batch_.verified();
    // A bond that was not named spoils the rest of the batch.
    head_ = head_ < verified.size() && verified[head_].bond == bond ? head_ + 1 : verified.size();
  }

 private:
  void follow(BondId bond) override { late_.push_back(bond); }

  [[nodiscard]] bool move_plate(std::span<double> u) override {
    if (responding_) {
      if (is_loose(u)) return true;
      leave_response();
      late_.clear();
    }
    if (!batch_.waiting().empty()) (void)take_in();
    const PhaseScope scope(times_, Phase::downdate);
    (void)factor_.downdate(late_);
    const bool lost = !late_.empty() && !(factor_.held_slack() > kLeastSlack);
    late_.clear();
    if (lost) make_factor();
    factor_.move_plate(1, u);
    return !has_softened();
  }

  [[nodiscard]] bool solve_held(std::span<const double> load, std::span<double> x) override {
    factor_.solve_held(load, x);
    return true;
  }

  [[nodiscard]] std::size_t held_pins() const override {
    return static_cast<std::size_t>(factor_.pivots().null);
  }

  /// Nothing waits, nothing is predicted.
  void start_from_factor() {
    is_intact_ = false;
    responding_ = false;
    unsolved_ = true;
    batch_.reset(threshold());
    begin();
  }

  void begin() {
    late_.clear();
    head_ = 0;
    slack_ = 1;
    unchecked_ = 0;
    state_ = has_failed(factor_.stiffness()) ? State::failed : State::carrying;
  }

  void make_response() {
    response_ = std::make_unique<TreeResponse>(
        network_, make_intact_response(network_, tree_, bonds_, factor_, kernels_), kernels_,
        options_.break_on);
    responds_ = response_->is_sound();
  }

  [[nodiscard]] Critical responded() const {
    const ResponseBreak& found = response_->verified()[head_];
    return {found.bond, found.load, found.stiffness};
  }

  [[nodiscard]] Critical confirmed() const {
    const VerifiedBreak& found = batch_.verified()[head_];
    return {found.bond, 1 / found.ratio, 1 / batch_.plate(shown_)};
  }

  /// More verified breaks, or the end, or a factor goes on.
  void respond() {
    const ResponseResult result = look_ahead();
    if (result == ResponseResult::failed) state_ = State::failed;
    if (result == ResponseResult::lost) leave_response();
    if (result == ResponseResult::found && unchecked_ >= kBreaksPerCheck && !trusted()) leave_response();
  }

  ResponseResult look_ahead() {
    const PhaseScope scope(times_, Phase::search);
    const ResponseResult result = response_->next(kRefereedStiffness * intact_stiffness());
    head_ = 0;
    shown_ = 0;
    unchecked_ += std::ssize(response_->verified());
    return result;
  }

  /// A factor goes on from here.
  void leave_response() {
    ++tree_counts_.left;
    {
      const PhaseScope scope(times_, Phase::factor);
      factor_.factorize(broken());
    }
    const double slack = slack_;
    start_from_factor();
    if (has_softened()) state_ = State::failed;
    if (state_ == State::carrying && slack > 0) note(slack);
  }

  /// Of a break that has left something carrying.
  void note(double slack) { counts_.smallest_slack = std::min(counts_.smallest_slack, slack); }

  /// The last break has set a motion free that moves the plate and stretches nothing.
  [[nodiscard]] bool is_loose(std::span<double> u) {
    const PhaseScope scope(times_, Phase::search);
    if (!response_->get_free_motion(u)) return false;
    return energy(network_, broken(), u) <= kFailedStiffness * intact_stiffness();
  }

  /// At least one verified break, or another state than carrying.
  void advance() {
    if (batch_.full() && !take_in()) return;
    BatchResult result = pass();
    if (result == BatchResult::found && unchecked_ >= kBreaksPerCheck && !trusted()) {
      refactor();
      result = pass();
    }
    if (result == BatchResult::stale) {
      if (!take_in()) return;
      result = pass();
    }
    // stale still: a fresh factor doesn't confirm its own forces
    if (result != BatchResult::found) state_ = State::failed;
  }

  BatchResult pass() {
    const BatchResult result = batch_.next(kRefereedStiffness * intact_stiffness());
    unsolved_ = false;
    head_ = 0;
    unchecked_ += static_cast<std::int64_t>(batch_.verified().size());
    return result;
  }

  /// The factor takes in the waiting breaks. False: what is left is not for double.
  bool take_in() {
    const PhaseScope scope(times_, Phase::downdate);
    const double slack = factor_.downdate(batch_.waiting());
    ++tree_counts_.downdates;
    const bool gone = !(factor_.stiffness() > kRefereedStiffness * intact_stiffness());
    if (!((gone ? factor_.held_slack() : slack) > kLeastSlack)) make_factor();
    batch_.refresh();
    if (has_failed(factor_.stiffness()) || has_softened()) {
      state_ = State::failed;
      return false;
    }
    note(slack);
    return true;
  }

  /// Breaks make no new null pivot, since a bond that carries force holds no motion alone.
  [[nodiscard]] bool has_softened() const {
    const TreePivots& now = factor_.pivots();
    return now.null > intact_pivots_.null || now.smallest < kSoftPivot;
  }

  void refactor() {
    const PhaseScope scope(times_, Phase::factor);
    make_factor();
    batch_.refresh();
  }

  void make_factor() {
    factor_.factorize(broken());
    ++counts_.refactors;
  }

  /// The residual of the present state, from the bonds.
  bool trusted() {
    const PhaseScope scope(times_, Phase::search);
    unchecked_ = 0;
    shown_ = 0;
    const double error = backward_error(network_, broken(), do_displacements(), residual_);
    counts_.largest_residual = std::max(counts_.largest_residual, error);
    return error <= kLargestError;
  }

  /// Compares what find_critical says with a factor from scratch and every force.
  void check(const Critical& next) {
    checker_->factorize(broken());
    checker_->solve_plate(residual_);
    Critical expected;
    const State state = has_failed(1 / residual_.back()) ? State::failed : scan(residual_, expected);
    const bool same = state == state_ && (state != State::carrying || expected.bond == next.bond);
    ++tree_counts_.checked;
    tree_counts_.differences += same ? 0 : 1;
  }

  SeparatorTree tree_;
  TreeBonds bonds_;
  const TreeKernels& kernels_;
  TreeScratch scratch_;
  TreeFactor factor_;
  TreeBatch batch_;
  std::unique_ptr<TreeFactor> checker_;     // with verify
  std::unique_ptr<TreeResponse> response_;  // once made
  bool responds_;                           // samples begin with it
  bool responding_ = false;                 // it is as far as this sample is; the factor is intact
  bool is_intact_ = false;                  // the factor is the intact network's
  bool unsolved_ = true;                    // the factor's state has not been solved for
  double slack_ = 1;                        // of the last break, by response_
  State state_ = State::carrying;
  std::vector<BondId> late_;    // broken since the Referee took over: the factor hasn't taken them in
  std::size_t head_ = 0;        // verified breaks that have been removed
  int shown_ = 0;               // state that find_critical saw last
  std::int64_t unchecked_ = 0;  // breaks since the last look at the backward error
  TreePivots intact_pivots_;
  TreeCounts tree_counts_;
  std::vector<double> displacement_;
  std::vector<double> residual_;
};

}  // namespace

std::unique_ptr<Equilibrium> make_equilibrium_tree(const Network& network, const EquilibriumOptions& options,
                                                   PhaseTimes& times, const TreeOptions& tree) {
  return std::make_unique<EquilibriumTree>(network, options, times, tree);
}

TreeCounts tree_counts(const Equilibrium& equilibrium) {
  return dynamic_cast<const EquilibriumTree&>(equilibrium).tree_counts();
}

}  // namespace crackle
