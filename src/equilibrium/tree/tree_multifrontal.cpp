#include "crackle/equilibrium/tree/tree_multifrontal.hpp"

#include <cblas.h>

#include <algorithm>
#include <vector>

#include "crackle/factor/null_pivot.hpp"

namespace crackle {

namespace {

constexpr int kPanel = 48;   // columns eliminated one by one before the rest is updated by dgemm
constexpr int kStrip = 192;  // columns of the rest updated together: bounds the work above the diagonal

class Multifrontal {
 public:
  Multifrontal(const SeparatorTree& tree, const TreeBonds& bonds, std::span<const std::uint8_t> broken,
               const FactorStorage& factor)
      : tree_(tree), bonds_(bonds), broken_(broken), factor_(factor), start_(tree.fronts()) {
    std::size_t tallest = 0;
    std::size_t top = 0;
    std::size_t peak = 0;
    for (FrontId f = 0; f < tree.fronts(); ++f) {
      tallest = std::max(tallest, height(f));
      start_[f] = below_children(f, top);
      top = start_[f] + left(f);
      peak = std::max(peak, top);
    }
    stack_.resize(peak);
    matrix_.resize(tallest * tallest);
    scaled_.resize(tallest * kPanel);
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
    std::fill_n(matrix_.data(), rows * rows, 0.0);
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
    for (std::size_t c = 0; c < size; ++c) {
      // Both lists ascend by position, so the lower triangle stays the lower triangle.
      double* target = column(f, to[c]);
      for (std::size_t r = c; r < size; ++r) target[to[r]] += from[r + c * size];
    }
  }

  void eliminate(FrontId f) {
    const int pivots = tree_.front[f].pivots;
    const int rows = static_cast<int>(height(f));
    for (int start = 0; start < pivots; start += kPanel) {
      const int end = std::min(start + kPanel, pivots);
      for (int c = start; c < end; ++c) eliminate_column(f, c, start, end);
      for (int strip = end; strip < rows; strip += kStrip) {
        const int width = std::min(kStrip, rows - strip);
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows - strip, width, end - start, -1.0,
                    column(f, start) + strip, rows, scaled_.data() + strip, rows, 1.0,
                    column(f, strip) + strip, rows);
      }
    }
  }

  /// Column c of L, and its effect on the rest of its panel. scaled_: the panel's columns before the division
  /// by D.
  void eliminate_column(FrontId f, int c, int start, int end) {
    const auto rows = static_cast<int>(height(f));
    const Position at = tree_.front[f].first + c;
    double* l = column(f, c);
    double* kept = scaled_.data() + static_cast<std::size_t>(c - start) * rows;
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
    for (int next = c + 1; next < end; ++next) {
      double* target = column(f, next);
      for (int r = next; r < rows; ++r) target[r] -= kept[next] * l[r];
    }
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
      std::copy_n(column(f, front.pivots + c) + front.pivots, front.boundary, rest);
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
  std::vector<double> original_;  // [positions] diagonal of K
  TreePivots pivots_;
};

}  // namespace

TreePivots factorize_tree(const SeparatorTree& tree, const TreeBonds& bonds,
                          std::span<const std::uint8_t> broken, const FactorStorage& factor) {
  return Multifrontal(tree, bonds, broken, factor).run();
}

}  // namespace crackle
