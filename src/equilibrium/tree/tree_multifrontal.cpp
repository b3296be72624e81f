#include "crackle/equilibrium/tree/tree_multifrontal.hpp"

#include <cblas.h>

#include <algorithm>
#include <vector>

#include "crackle/factor/null_pivot.hpp"

namespace crackle {

namespace {

// Elementwise loops without fused products: the same bits whatever the vectors' length, chosen at run time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define CRACKLE_ANY_VECTORS __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CRACKLE_ANY_VECTORS
#endif

constexpr int kPanel = 384;      // columns whose effect on the rest of a front is taken in at once
constexpr int kInner = 8;        // columns eliminated one by one; more are halved
constexpr int kLeastStrip = 32;  // columns updated by one dgemm: bounds the work above the diagonal
constexpr int kMostStrip = 192;
constexpr int kStripsOfFront = 6;

/// Of a column of L from its diagonal down, and of those right of it, `height` apart: they take it in. kept: that
/// column times D.
CRACKLE_ANY_VECTORS
void update_columns(double* column, int columns, int height, int rows, const double* kept) {
  for (int c = 1; c < columns; ++c) {
    double* target = column + static_cast<std::ptrdiff_t>(c) * height;
    const double factor = kept[c];
    for (int r = c; r < rows; ++r) target[r] -= factor * column[r];
  }
}

CRACKLE_ANY_VECTORS
void add(const double* from, std::size_t size, double* to) {
  for (std::size_t i = 0; i < size; ++i) to[i] += from[i];
}

class Multifrontal {
 public:
  Multifrontal(const SeparatorTree& tree, const TreeBonds& bonds, std::span<const std::uint8_t> broken,
               const FactorStorage& factor)
      : tree_(tree), bonds_(bonds), broken_(broken), factor_(factor), start_(tree.fronts()) {
    std::size_t tallest = 0;
    std::size_t top = 0;
    std::size_t peak = 0;
    int widest = 0;
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      tallest = std::max(tallest, height(f));
      widest = std::max(widest, tree.front[f].pivots);
      start_[f] = below_children(f, top);
      top = start_[f] + left(f);
      peak = std::max(peak, top);
    }
    stack_.resize(peak);
    matrix_.resize(tallest * tallest);
    scaled_.resize(tallest * std::min(widest, kPanel));
    find_diagonal();
  }

  TreePivots run() {
    for (FrontId f = 0; f < tree_.fronts(); ++f) {
      assemble(f);
      eliminate(f);
      store(f);
    }
    return pivots_;
  }

 private:
  [[nodiscard]] std::size_t height(FrontId f) const {
    return static_cast<std::size_t>(tree_.front[f].pivots) + tree_.front[f].boundary;
  }
  [[nodiscard]] std::size_t left(FrontId f) const {
    return static_cast<std::size_t>(tree_.front[f].boundary) * tree_.front[f].boundary;
  }
  [[nodiscard]] bool is_broken(BondId e) const { return !broken_.empty() && broken_[e] != 0; }
  [[nodiscard]] double* column(FrontId f, int c) {
    return matrix_.data() + static_cast<std::size_t>(c) * height(f);
  }

  template <class Action>
  void for_each_child(FrontId f, Action action) const {
    const FrontId first = tree_.front[f].first_descendant;
    for (FrontId child = f - 1; child >= first; child = tree_.front[child].first_descendant - 1)
      action(child);
  }

  /// Where the stack ends once the front has taken in what its children left.
  [[nodiscard]] std::size_t below_children(FrontId f, std::size_t top) const {
    for_each_child(f, [&](FrontId child) { top = std::min(top, start_[child]); });
    return top;
  }

  void find_diagonal() {
    original_.assign(tree_.positions(), 0.0);
    for (const BondId e : bonds_.by_owner) {
      if (is_broken(e)) continue;
      for (int i = 0; i < bonds_.width; ++i) {
        original_[bonds_.rows(e)[i]] += bonds_.values(e)[i] * bonds_.values(e)[i];
      }
    }
  }

  /// The front's (p + q) x (p + q) matrix, column-major, lower triangle.
  void assemble(FrontId f) {
    const Front& front = tree_.front[f];
    const std::size_t rows = height(f);
    for (std::size_t c = 0; c < rows; ++c) std::fill_n(matrix_.data() + c * rows + c, rows - c, 0.0);
    const auto boundary = tree_.boundary(f);
    const auto local = [&](Position at) -> std::size_t {
      if (at < front.first + front.pivots) return at - front.first;
      return front.pivots + (std::ranges::lower_bound(boundary, at) - boundary.begin());
    };
    for (std::int32_t i = bonds_.start[f]; i < bonds_.start[f + 1]; ++i) {
      const BondId e = bonds_.by_owner[i];
      if (is_broken(e)) continue;
      const auto at = bonds_.rows(e);
      const auto value = bonds_.values(e);
      for (int a = 0; a < bonds_.width; ++a) {
        for (int b = 0; b < bonds_.width; ++b) {
          if (value[a] == 0 || value[b] == 0 || at[a] < at[b]) continue;
          matrix_[local(at[a]) + local(at[b]) * rows] += value[a] * value[b];
        }
      }
    }
    for_each_child(f, [&](FrontId child) { extend_add(f, child); });
  }

  void extend_add(FrontId f, FrontId child) {
    const std::size_t size = tree_.front[child].boundary;
    const double* from = stack_.data() + start_[child];
    const std::int32_t* to = tree_.parent_row.data() + tree_.front[child].rows;
    find_runs({to, size});
    std::size_t run = 0;
    for (std::size_t c = 0; c < size; ++c, from += size) {
      // Both lists ascend by position, so the lower triangle stays the lower triangle.
      double* target = column(f, to[c]);
      if (c == run_end_[run]) ++run;
      std::size_t begin = c;
      for (std::size_t i = run; i < run_end_.size(); ++i) {
        add(from + begin, run_end_[i] - begin, target + to[begin]);
        begin = run_end_[i];
      }
    }
  }

  /// Where runs of consecutive rows end.
  void find_runs(std::span<const std::int32_t> row) {
    run_end_.clear();
    for (std::size_t i = 1; i < row.size(); ++i) {
      if (row[i] != row[i - 1] + 1) run_end_.push_back(i);
    }
    run_end_.push_back(row.size());
  }

  void eliminate(FrontId f) {
    const int pivots = tree_.front[f].pivots;
    for (int start = 0; start < pivots; start += kPanel) {
      const int end = std::min(start + kPanel, pivots);
      eliminate_columns(f, start, start, end);
      update(f, start, start, end, static_cast<int>(height(f)));
    }
  }

  /// Columns begin .. end - 1 of a panel, which have taken in all before them.
  void eliminate_columns(FrontId f, int panel, int begin, int end) {
    if (end - begin <= kInner) {
      for (int c = begin; c < end; ++c) eliminate_column(f, panel, c, end);
      return;
    }
    const int middle = begin + ((end - begin) / 2 + kInner - 1) / kInner * kInner;
    eliminate_columns(f, panel, begin, middle);
    update(f, panel, begin, middle, end);
    eliminate_columns(f, panel, middle, end);
  }

  /// Columns end .. last - 1 take in columns begin .. end - 1 of L.
  void update(FrontId f, int panel, int begin, int end, int last) {
    const auto rows = static_cast<int>(height(f));
    const int most = std::clamp((last - end) / kStripsOfFront, kLeastStrip, kMostStrip);
    const double* scaled = scaled_.data() + static_cast<std::size_t>(begin - panel) * rows;
    for (int strip = end; strip < last; strip += most) {
      const int width = std::min(most, last - strip);
      cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows - strip, width, end - begin, -1.0,
                  column(f, begin) + strip, rows, scaled + strip, rows, 1.0, column(f, strip) + strip, rows);
    }
  }

  /// Column c of L, and its effect on columns up to end - 1. scaled_: the panel's columns before the division by D.
  void eliminate_column(FrontId f, int panel, int c, int end) {
    const auto rows = static_cast<int>(height(f));
    const Position at = tree_.front[f].first + c;
    double* l = column(f, c);
    double* kept = scaled_.data() + static_cast<std::size_t>(c - panel) * rows;
    const bool plate = at + 1 == tree_.positions();
    const bool null = !plate && !(l[c] > kNullPivot * original_[at]);
    pivots_.null += null ? 1 : 0;
    if (!plate && !null) pivots_.smallest = std::min(pivots_.smallest, l[c] / original_[at]);
    factor_.diagonal[at] = null ? 0 : l[c];
    factor_.inverse[at] = null ? 0 : 1 / l[c];
    for (int r = c + 1; r < rows; ++r) {
      kept[r] = null ? 0 : l[r];
      l[r] *= factor_.inverse[at];
    }
    l[c] = 1;
    update_columns(l + c, end - c, rows, rows - c, kept + c);
  }

  void store(FrontId f) {
    const Front& front = tree_.front[f];
    const std::size_t rows = height(f);
    double* block = factor_.entries.data() + front.block;
    for (int c = 0; c < front.pivots; ++c, block += front.stride) {
      std::fill_n(block, c, 0.0);
      std::copy(column(f, c) + c, column(f, c) + rows, block + c);
      std::fill(block + rows, block + front.stride, 0.0);
    }
    double* rest = stack_.data() + start_[f];
    for (int c = 0; c < front.boundary; ++c, rest += front.boundary) {
      std::copy_n(column(f, front.pivots + c) + front.pivots + c, front.boundary - c, rest + c);
    }
  }

  const SeparatorTree& tree_;
  const TreeBonds& bonds_;
  std::span<const std::uint8_t> broken_;
  FactorStorage factor_;
  std::vector<std::size_t> start_;  // [fronts] of what each leaves, on the stack
  std::vector<double> stack_;
  std::vector<double> matrix_;
  std::vector<double> scaled_;
  std::vector<std::size_t> run_end_;  // of the child's rows being added
  std::vector<double> original_;      // [positions] diagonal of K
  TreePivots pivots_;
};

}  // namespace

TreePivots factorize_tree(const SeparatorTree& tree, const TreeBonds& bonds,
                          std::span<const std::uint8_t> broken, const FactorStorage& factor) {
  return Multifrontal(tree, bonds, broken, factor).run();
}

}  // namespace crackle
