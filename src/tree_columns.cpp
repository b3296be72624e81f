#include "crackle/tree_columns.hpp"

#include <algorithm>
#include <array>

namespace crackle {

TreeColumns::TreeColumns(const SeparatorTree& tree, const TreeBonds& bonds, const TreeFactor& factor,
                         const TreeKernels& kernels, std::span<double> scratch)
    : tree_(tree),
      bonds_(bonds),
      factor_(factor),
      kernels_(kernels),
      panel_(kMost / kLanes),
      gram_(static_cast<std::size_t>(kMost) * kMost),
      work_(scratch),
      spread_(static_cast<std::size_t>(kMost) * kLanes),
      on_path_(tree.fronts(), 0) {
  for (Panel& panel : panel_) panel.offset.assign(tree.fronts(), -1);
  bond_.reserve(kMost);
  sorted_.reserve(kMost);
}

void TreeColumns::clear() {
  for (int p = 0; p < panels_; ++p) {
    for (const FrontId f : panel_[p].path) panel_[p].offset[f] = -1;
  }
  panels_ = 0;
  bond_.clear();
}

int TreeColumns::add(std::span<const BondId> chosen) {
  const int room = kMost - size();
  const int taken = std::min(room, static_cast<int>(chosen.size()));
  sorted_.assign(chosen.begin(), chosen.begin() + taken);
  // Neighbours in the tree share a panel, and so their paths.
  std::ranges::sort(sorted_, [&](BondId a, BondId b) {
    return bonds_.owner[a] != bonds_.owner[b] ? bonds_.owner[a] < bonds_.owner[b] : a < b;
  });
  for (int done = 0; done < taken; done += kLanes) {
    const int count = std::min(kLanes, taken - done);
    bond_.insert(bond_.end(), sorted_.begin() + done, sorted_.begin() + done + count);
    bond_.resize(static_cast<std::size_t>(panels_ + 1) * kLanes, -1);
    solve(panel_[panels_], std::span(sorted_).subspan(done, count));
    for (int p = 0; p <= panels_; ++p) multiply(p, panels_);
    ++panels_;
  }
  return taken;
}

void TreeColumns::solve(Panel& panel, std::span<const BondId> bonds) {
  for (std::size_t lane = 0; lane < bonds.size(); ++lane) {
    for (int i = 0; i < bonds_.width; ++i) {
      work_[static_cast<std::size_t>(bonds_.rows(bonds[lane])[i]) * kLanes + lane] +=
          bonds_.values(bonds[lane])[i];
    }
  }
  find_path(tree_, bonds_, bonds, on_path_, panel.path);
  std::size_t needed = 0;
  for (const FrontId f : panel.path) needed += tree_.front[f].pivots;
  if (panel.rows.size() < needed * kLanes) {
    panel.rows.clear();  // nothing to keep
    panel.rows.reserve(needed * kLanes * 5 / 4);
    panel.rows.resize(needed * kLanes);
  }
  fronts_visited_ += static_cast<std::int64_t>(panel.path.size());
  std::int32_t next = 0;
  for (std::size_t i = 0; i < panel.path.size(); ++i) {
    const FrontId f = panel.path[i];
    const Front& front = tree_.front[f];
    double* pivots = work_.data() + static_cast<std::size_t>(front.first) * kLanes;
    kernels_.forward(factor_.block(f, panel.path[std::min(i + 1, panel.path.size() - 1)]), pivots,
                     work_.data());
    std::copy_n(pivots, front.pivots * kLanes, panel.rows.data() + static_cast<std::size_t>(next) * kLanes);
    std::fill_n(pivots, front.pivots * kLanes, 0.0);
    entries_read_ += front.entries();
    panel.offset[f] = next;
    next += front.pivots;
  }
}

/// The block of G between two panels, and its transpose.
void TreeColumns::multiply(int a, int b) {
  double* block =
      gram_.data() + static_cast<std::size_t>(a) * kLanes * kMost + static_cast<std::size_t>(b) * kLanes;
  for (int i = 0; i < kLanes; ++i) std::fill_n(block + static_cast<std::size_t>(i) * kMost, kLanes, 0.0);
  const Panel& left = panel_[a];
  const Panel& right = panel_[b];
  for (const FrontId f : right.path) {
    if (left.offset[f] < 0) continue;
    kernels_.gram(left.rows.data() + static_cast<std::size_t>(left.offset[f]) * kLanes,
                  right.rows.data() + static_cast<std::size_t>(right.offset[f]) * kLanes,
                  factor_.inverse_pivots(f), tree_.front[f].pivots, block, kMost);
  }
  if (a == b) return;
  for (int i = 0; i < kLanes; ++i) {
    for (int j = 0; j < kLanes; ++j) {
      gram_[static_cast<std::size_t>(b * kLanes + j) * kMost + a * kLanes + i] =
          block[static_cast<std::size_t>(i) * kMost + j];
    }
  }
}

double TreeColumns::stretch(int i) const {
  const Panel& panel = panel_[i / kLanes];
  const FrontId plate = tree_.fronts() - 1;
  return panel.rows[static_cast<std::size_t>(panel.offset[plate]) * kLanes + i % kLanes] *
         *factor_.inverse_pivots(plate);
}

void TreeColumns::combine(std::span<const int> columns, const double* coefficient, double* x,
                          std::vector<FrontId>& fronts) {
  std::array<bool, kMost / kLanes> used{};
  std::ranges::fill(spread_, 0.0);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    used[columns[i] / kLanes] = true;
    std::copy_n(coefficient + i * kLanes, kLanes,
                spread_.data() + static_cast<std::size_t>(columns[i]) * kLanes);
  }
  const FrontId plate = tree_.fronts() - 1;
  fronts.assign(1, plate);
  on_path_[plate] = 1;
  for (int p = 0; p < panels_; ++p) {
    if (!used[p]) continue;
    for (const FrontId f : panel_[p].path) {
      if (on_path_[f] == 0) fronts.push_back(f);
      on_path_[f] = 1;
    }
  }
  std::ranges::sort(fronts);
  std::array<PanelPart, kMost / kLanes> part;
  for (const FrontId f : fronts) {
    on_path_[f] = 0;
    int parts = 0;
    for (int p = 0; p < panels_; ++p) {
      const std::int32_t offset = panel_[p].offset[f];
      if (!used[p] || offset < 0) continue;
      part[parts++] = {panel_[p].rows.data() + static_cast<std::size_t>(offset) * kLanes,
                       spread_.data() + static_cast<std::size_t>(p) * kLanes * kLanes};
    }
    kernels_.combine(part.data(), parts, factor_.inverse_pivots(f), tree_.front[f].pivots,
                     x + static_cast<std::size_t>(tree_.front[f].first) * kLanes);
  }
  double* load = x + static_cast<std::size_t>(tree_.front[plate].first) * kLanes;
  for (int lane = 0; lane < kLanes; ++lane) load[lane] += *factor_.inverse_pivots(plate);
}

}  // namespace crackle
