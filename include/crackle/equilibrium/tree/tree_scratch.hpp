/// Who works on a tree, and the memory that a downdate and a forward pass work in, one after the other: zero whenever
/// nobody has it.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/base/thread_team.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"
#include "crackle/equilibrium/tree/tree_parts.hpp"

namespace crackle {

/// Of a front that threads share: columns that one takes ahead of the rows below them, which all share. Few enough for what
/// it does alone to be little, enough for a loop of the threads (two microseconds) to be worth it.
inline constexpr int kColumnsTogether = 64;
/// Entries times right-hand sides of such a front, at least: some ten microseconds.
inline constexpr std::int64_t kLeastShared = 200'000;

/// Up to where kernels work on whole vectors of rows.
constexpr int whole_rows(int rows) {
  return (rows + kRowsTogether - 1) / kRowsTogether * kRowsTogether;
}

/// Rows that one thread takes at a time: two turns for each, but not less than half a microsecond of work.
constexpr int share_of_rows(int rows, int threads) {
  constexpr int kLeastRows = 64;
  return whole_rows(std::max(kLeastRows, rows / (2 * threads) + 1));
}

class TreeScratch {
 public:
  /// tree must outlive this. With one thread the tree stays in one piece. Throws InputError about
  /// -equilibrium_tree_threads when the system starts no more.
  explicit TreeScratch(const SeparatorTree& tree, int threads = 1)
      : team_(threads, "-equilibrium_tree_threads"),
        parts_(threads > 1 ? make_tree_parts(tree) : make_whole_tree(tree)),
        value_(static_cast<std::size_t>(tree.positions()) * kLanes),
        local_(threads) {
    std::size_t most = 0;
    for (const TreePart& part : parts_.part)
      most = std::max(most, static_cast<std::size_t>(part.size()) + tree.front[part.root].boundary);
    for (AlignedVector& local : local_) local.resize(most * kLanes);
  }

  [[nodiscard]] ThreadTeam& team() { return team_; }
  [[nodiscard]] const TreeParts& parts() const { return parts_; }
  /// Whether threads share a front at the top; work: its entries times right-hand sides.
  [[nodiscard]] bool shares(std::int64_t work) const { return team_.threads() > 1 && work >= kLeastShared; }

  /// All of it, for the length of this life, by the end of which it is zero again.
  class Loan {
   public:
    explicit Loan(TreeScratch& owner) : owner_(owner) {
      assert(!owner.lent_);
      assert(owner.is_zero());
      owner.lent_ = true;
    }
    ~Loan() {
      assert(owner_.is_zero());
      owner_.lent_ = false;
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;

    /// [positions * kLanes]
    [[nodiscard]] double* data() const { return owner_.value_.data(); }
    /// A member's own, for one part: [local rows * kLanes], see TreeParts::local_row.
    [[nodiscard]] double* local(int member) const { return owner_.local_[member].data(); }

   private:
    TreeScratch& owner_;
  };

  [[nodiscard]] bool is_zero() const {
    const auto zero = [](const AlignedVector& all) {
      return std::ranges::all_of(all, [](double x) { return x == 0; });
    };
    return zero(value_) && std::ranges::all_of(local_, zero);
  }

 private:
  ThreadTeam team_;
  TreeParts parts_;
  AlignedVector value_;
  std::vector<AlignedVector> local_;  // [threads]
  bool lent_ = false;
};

}  // namespace crackle
