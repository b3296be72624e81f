#include "crackle/equilibrium/tree/tree_factor.hpp"

#include <cblas.h>

#include <algorithm>
#include <cassert>
#include <set>

#include "crackle/equilibrium/tree/tree_multifrontal.hpp"

namespace crackle {

namespace {

/// No bond is there twice.
[[maybe_unused]] bool has_no_twins(std::span<const BondId> bonds) {
  return std::set(bonds.begin(), bonds.end()).size() == bonds.size();
}

}  // namespace

TreeFactor::TreeFactor(const SeparatorTree& tree, const TreeBonds& bonds, const TreeKernels& kernels,
                       bool keep_intact, TreeScratch& scratch)
    : tree_(tree),
      bonds_(bonds),
      kernels_(kernels),
      keep_intact_(keep_intact),
      entries_(tree.block_entries),
      diagonal_(tree.positions()),
      inverse_(tree.positions()),
      changed_at_(tree.fronts(), 0),
      downdate_(tree, bonds, kernels, scratch) {
  std::int32_t tallest = 0;
  for (const Front& front : tree.front) tallest = std::max(tallest, front.stride);
  column_.resize(tallest);
}

void TreeFactor::factorize(std::span<const std::uint8_t> broken) {
  ++factorizations_;
  note_change_of_all();
  pivots_ = factorize_tree(tree_, bonds_, broken, {entries_, diagonal_, inverse_});
}

void TreeFactor::note_change_of_all() {
  std::ranges::fill(changed_at_, ++changes_);
}

/// copy(column, saved, rows) for every column from its diagonal down, and where it is kept in
/// intact_entries_.
template <class Copy>
void TreeFactor::for_each_column(Copy copy) {
  double* saved = intact_entries_.data();
  for (const Front& front : tree_.front) {
    double* column = entries_.data() + front.block;
    for (int rows = front.pivots + front.boundary; rows > front.boundary; --rows) {
      copy(column, saved, rows);
      saved += rows;
      column += front.stride + 1;
    }
  }
}

void TreeFactor::restore() {
  if (intact_entries_.empty()) {
    factorize({});
    if (!keep_intact_) return;
    intact_entries_.resize(static_cast<std::size_t>(tree_.factor_entries));
    for_each_column([](const double* column, double* saved, int rows) { std::copy_n(column, rows, saved); });
    intact_diagonal_ = diagonal_;
    intact_inverse_ = inverse_;
    intact_pivots_ = pivots_;
    return;
  }
  note_change_of_all();
  for_each_column([](double* column, const double* saved, int rows) { std::copy_n(saved, rows, column); });
  std::ranges::copy(intact_diagonal_, diagonal_.begin());
  std::ranges::copy(intact_inverse_, inverse_.begin());
  pivots_ = intact_pivots_;
}

void TreeFactor::move_plate(double plate, std::span<double> u) const {
  std::vector<double> x(tree_.positions());
  x.back() = plate;
  substitute_back(x);
  std::ranges::fill(u, 0.0);
  for (Position at = 0; at < tree_.positions(); ++at) u[tree_.dof[at]] = x[at];
}

void TreeFactor::solve_held(std::span<const double> load, std::span<double> x) const {
  std::vector<double> y(tree_.positions());
  std::vector<double> boundary;
  for (Position at = 0; at < tree_.positions(); ++at) y[at] = load[tree_.dof[at]];
  for (FrontId f = 0; f + 1 < tree_.fronts(); ++f) {
    const Front& front = tree_.front[f];
    const double* entries = entries_.data() + front.block;
    double* own = y.data() + front.first;
    cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasUnit, front.pivots, entries, front.stride, own,
                1);
    if (front.boundary == 0) continue;
    boundary.assign(front.boundary, 0.0);
    cblas_dgemv(CblasColMajor, CblasNoTrans, front.boundary, front.pivots, 1.0, entries + front.pivots,
                front.stride, own, 1, 0.0, boundary.data(), 1);
    const auto rows = tree_.boundary(f);
    for (int i = 0; i < front.boundary; ++i) y[rows[i]] -= boundary[i];
  }
  for (Position at = 0; at < tree_.positions(); ++at) y[at] *= inverse_[at];
  y.back() = 0;
  substitute_back(y);
  std::ranges::fill(x, 0.0);
  for (Position at = 0; at < tree_.positions(); ++at) x[tree_.dof[at]] = y[at];
}

void TreeFactor::substitute_back(std::span<double> x) const {
  for (FrontId f = tree_.fronts() - 2; f >= 0; --f)
    kernels_.settle(block(f), x.data() + tree_.front[f].first, x.data(), column_.data(), nullptr, nullptr);
}

double TreeFactor::downdate(std::span<const BondId> bonds) {
  assert(has_no_twins(bonds));
  double smallest = 1;
  held_slack_ = 1;
  for (std::size_t done = 0; done < bonds.size(); done += TreeDowndate::kMost) {
    const std::size_t count = std::min<std::size_t>(TreeDowndate::kMost, bonds.size() - done);
    const TreeDowndate::Slack slack =
        downdate_.run(bonds.subspan(done, count), {entries_, diagonal_, inverse_});
    ++changes_;
    for (const FrontId f : downdate_.path()) changed_at_[f] = changes_;
    smallest = std::min(smallest, slack.smallest);
    held_slack_ = std::min(held_slack_, slack.held);
  }
  return smallest;
}

}  // namespace crackle
