#include "crackle/equilibrium/tree/tree_columns.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>

namespace crackle {

TreeColumns::TreeColumns(const SeparatorTree& tree, const TreeBonds& bonds, const TreeFactor& factor,
                         const TreeKernels& kernels, TreeScratch& scratch)
    : tree_(tree),
      bonds_(bonds),
      factor_(factor),
      kernels_(kernels),
      column_of_(bonds.place.size(), -1),
      panel_(kMost / kLanes),
      gram_(static_cast<std::size_t>(kMost) * kMost),
      scratch_(scratch),
      spread_(static_cast<std::size_t>(kMost) * kLanes),
      on_path_(tree.fronts(), 0),
      panels_at_(tree.fronts(), 0) {
  std::int32_t tallest = 0;
  for (const Front& front : tree.front) tallest = std::max(tallest, front.stride);
  column_.resize(tallest);
  for (Panel& panel : panel_) panel.place.resize(tree.fronts());
  bond_.reserve(kMost);
  sorted_.reserve(kMost);
}

void TreeColumns::clear() {
  for (int p = 0; p < panels_; ++p) {
    for (const FrontId f : panel_[p].path) {
      panel_[p].place[f] = {};
      panels_at_[f] = 0;
    }
  }
  for (const BondId e : bond_) {
    if (e >= 0) column_of_[e] = -1;
  }
  panels_ = 0;
  bond_.clear();
}

int TreeColumns::add(std::span<const BondId> chosen) {
  const int room = kMost - size();
  const int taken = std::min(room, static_cast<int>(chosen.size()));
  sorted_.assign(chosen.begin(), chosen.begin() + taken);
  assert(std::ranges::find_first_of(sorted_, bond_) == sorted_.end());
  // Neighbours in the tree share a panel, and so their paths.
  std::ranges::sort(sorted_, [&](BondId a, BondId b) {
    return bonds_.owner[a] != bonds_.owner[b] ? bonds_.owner[a] < bonds_.owner[b] : a < b;
  });
  for (int done = 0; done < taken; done += kLanes) {
    const int count = std::min(kLanes, taken - done);
    for (int i = 0; i < count; ++i) column_of_[sorted_[done + i]] = size() + i;
    bond_.insert(bond_.end(), sorted_.begin() + done, sorted_.begin() + done + count);
    bond_.resize(static_cast<std::size_t>(panels_ + 1) * kLanes, -1);
    solve(panel_[panels_], std::span(sorted_).subspan(done, count));
    for (const FrontId f : panel_[panels_].path) panels_at_[f] |= std::uint32_t{1} << panels_;
    for (int p = 0; p <= panels_; ++p) multiply(p, panels_);
    ++panels_;
  }
  return taken;
}

void TreeColumns::solve(Panel& panel, std::span<const BondId> bonds) {
  const TreeScratch::Loan loan(scratch_);
  double* const work = loan.data();
  for (std::size_t lane = 0; lane < bonds.size(); ++lane) {
    for (int i = 0; i < bonds_.width; ++i) {
      work[static_cast<std::size_t>(bonds_.rows(bonds[lane])[i]) * kLanes + lane] +=
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
    // Bonds come in the order of their owners, and a subtree is contiguous: so are the lanes that reach it.
    const auto owner = [this](BondId e) { return bonds_.owner[e]; };
    const auto begin = std::ranges::lower_bound(bonds, front.first_descendant, {}, owner) - bonds.begin();
    const auto end = std::ranges::upper_bound(bonds, f, {}, owner) - bonds.begin();
    panel.place[f] = {next, static_cast<std::int16_t>(begin), static_cast<std::int16_t>(end)};
    double* pivots = work + static_cast<std::size_t>(front.first) * kLanes;
    const FrontBlock block = factor_.block(f, panel.path[std::min(i + 1, panel.path.size() - 1)]);
    if (end - begin == 1) {
      kernels_.forward_one(block, pivots + begin, work + begin, column_.data());
    } else {
      kernels_.forward(block, pivots, work, static_cast<int>(begin), static_cast<int>(end));
    }
    std::copy_n(pivots, front.pivots * kLanes, panel.rows.data() + static_cast<std::size_t>(next) * kLanes);
    std::fill_n(pivots, front.pivots * kLanes, 0.0);
    entries_read_ += front.entries();
    next += front.pivots;
  }
}

/// The block of G between two panels, and its transpose. On each front the panel with fewer lanes goes first.
void TreeColumns::multiply(int a, int b) {
  alignas(AlignedAllocator<double>::kCacheLine) std::array<double, kLanes * kLanes> by_left{};
  alignas(AlignedAllocator<double>::kCacheLine) std::array<double, kLanes * kLanes> by_right{};
  const Panel& left = panel_[a];
  const Panel& right = panel_[b];
  for (const FrontId f : right.path) {
    const Place& at_left = left.place[f];
    const Place& at_right = right.place[f];
    if (at_left.offset < 0) continue;
    const double* rows_left = left.rows.data() + static_cast<std::size_t>(at_left.offset) * kLanes;
    const double* rows_right = right.rows.data() + static_cast<std::size_t>(at_right.offset) * kLanes;
    const double* weight = factor_.inverse_pivots(f);
    const int pivots = tree_.front[f].pivots;
    if (at_left.lanes() <= at_right.lanes()) {
      kernels_.gram(rows_left + at_left.begin, at_left.lanes(), rows_right, weight, pivots,
                    by_left.data() + at_left.begin * kLanes, kLanes);
    } else {
      kernels_.gram(rows_right + at_right.begin, at_right.lanes(), rows_left, weight, pivots,
                    by_right.data() + at_right.begin * kLanes, kLanes);
    }
  }
  for (int i = 0; i < kLanes; ++i) {
    for (int j = 0; j < kLanes; ++j) {
      const double sum = by_left[i * kLanes + j] + by_right[j * kLanes + i];
      gram_[static_cast<std::size_t>(a * kLanes + i) * kMost + b * kLanes + j] = sum;
      gram_[static_cast<std::size_t>(b * kLanes + j) * kMost + a * kLanes + i] = sum;
    }
  }
}

double TreeColumns::stretch(int i) const {
  const Panel& panel = panel_[i / kLanes];
  const FrontId plate = tree_.fronts() - 1;
  return panel.rows[static_cast<std::size_t>(panel.place[plate].offset) * kLanes + i % kLanes] *
         *factor_.inverse_pivots(plate);
}

/// Sorts the columns that take part, and their coefficients, by panel and lane.
void TreeColumns::spread(std::span<const int> columns, const double* coefficient) {
  std::array<std::int16_t, kMost> place;
  place.fill(-1);
  for (std::size_t i = 0; i < columns.size(); ++i) place[columns[i]] = static_cast<std::int16_t>(i);
  std::int32_t used = 0;
  for (int p = 0; p < panels_; ++p) {
    used_start_[p] = used;
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::int16_t i = place[p * kLanes + lane];
      if (i < 0) continue;
      used_lane_[used] = lane;
      std::copy_n(coefficient + static_cast<std::size_t>(i) * kLanes, kLanes,
                  spread_.data() + static_cast<std::size_t>(used) * kLanes);
      ++used;
    }
  }
  used_start_[panels_] = used;
}

/// act(front, part, parts) for every front, ascending, that columns of the combination reach, and the plate's.
template <class Act>
void TreeColumns::for_each_front(Act act) {
  std::uint32_t used = 0;
  for (int p = 0; p < panels_; ++p) {
    if (used_start_[p] < used_start_[p + 1]) used |= std::uint32_t{1} << p;
  }
  const FrontId plate = tree_.fronts() - 1;
  std::array<PanelPart, kMost / kLanes> part;
  for (FrontId f = 0; f <= plate; ++f) {
    std::uint32_t panels = panels_at_[f] & used;
    if (panels == 0 && f < plate) continue;
    int parts = 0;
    for (; panels != 0; panels &= panels - 1) {
      const int p = std::countr_zero(panels);
      const Place& place = panel_[p].place[f];
      std::int32_t first = used_start_[p];
      std::int32_t last = used_start_[p + 1];
      while (first < last && used_lane_[first] < place.begin) ++first;
      while (first < last && used_lane_[last - 1] >= place.end) --last;
      if (first == last) continue;
      part[parts++] = {panel_[p].rows.data() + static_cast<std::size_t>(place.offset) * kLanes,
                       used_lane_.data() + first, spread_.data() + static_cast<std::size_t>(first) * kLanes,
                       last - first};
    }
    if (parts > 0 || f == plate) act(f, part.data(), parts);
  }
}

void TreeColumns::combine(std::span<const int> columns, const double* coefficient, double* x,
                          std::vector<FrontId>& fronts) {
  assert(std::ranges::all_of(columns, [this](int c) { return c >= 0 && c < size() && bond_[c] >= 0; }));
  spread(columns, coefficient);
  fronts.clear();
  for_each_front([&](FrontId f, const PanelPart* part, int parts) {
    fronts.push_back(f);
    kernels_.combine(part, parts, factor_.inverse_pivots(f), tree_.front[f].pivots,
                     x + static_cast<std::size_t>(tree_.front[f].first) * kLanes);
  });
  const FrontId plate = tree_.fronts() - 1;
  double* load = x + static_cast<std::size_t>(tree_.front[plate].first) * kLanes;
  for (int lane = 0; lane < kLanes; ++lane) load[lane] += *factor_.inverse_pivots(plate);
}

void TreeColumns::combine_one(std::span<const int> columns, const double* coefficient,
                              std::span<double> x) const {
  std::ranges::fill(x, 0.0);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Panel& panel = panel_[columns[i] / kLanes];
    for (const FrontId f : panel.path) {
      const double* rows = panel.rows.data() + static_cast<std::size_t>(panel.place[f].offset) * kLanes;
      double* own = x.data() + tree_.front[f].first;
      for (int k = 0; k < tree_.front[f].pivots; ++k)
        own[k] += rows[k * kLanes + columns[i] % kLanes] * coefficient[i * kLanes];
    }
  }
  x.back() += 1;
  for (FrontId f = 0; f < tree_.fronts(); ++f) {
    double* own = x.data() + tree_.front[f].first;
    for (int k = 0; k < tree_.front[f].pivots; ++k) own[k] *= factor_.inverse_pivots(f)[k];
  }
}

void TreeColumns::combine_single(std::span<const int> columns, const double* coefficient, float* x, int lanes,
                                 std::vector<FrontId>& fronts) {
  spread(columns, coefficient);
  fronts.clear();
  for_each_front([&](FrontId f, const PanelPart* part, int parts) {
    fronts.push_back(f);
    kernels_.combine_single(part, parts, factor_.inverse_pivots(f), tree_.front[f].pivots,
                            x + static_cast<std::size_t>(tree_.front[f].first) * lanes, lanes);
  });
}

}  // namespace crackle
