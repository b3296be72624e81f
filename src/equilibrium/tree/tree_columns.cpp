#include "crackle/equilibrium/tree/tree_columns.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>

namespace crackle {

namespace {

/// Of a combination: fronts that one thread takes at a time.
constexpr int kFrontsTogether = 64;

}  // namespace

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
  column_.assign(scratch.team().threads(), AlignedVector(tallest));
  for (Panel& panel : panel_) panel.place.resize(tree.fronts());
  bond_.reserve(kMost);
  sorted_.reserve(kMost);
  parts_.reserve(kLanes);
  top_.reserve(tree.fronts());
  pairs_.reserve(panel_.size() * panel_.size());
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
  pairs_.clear();
  for (int done = 0; done < taken; done += kLanes) {
    const int count = std::min(kLanes, taken - done);
    for (int i = 0; i < count; ++i) column_of_[sorted_[done + i]] = size() + i;
    bond_.insert(bond_.end(), sorted_.begin() + done, sorted_.begin() + done + count);
    bond_.resize(static_cast<std::size_t>(panels_ + 1) * kLanes, -1);
    solve(panel_[panels_], std::span(sorted_).subspan(done, count));
    for (const FrontId f : panel_[panels_].path) panels_at_[f] |= std::uint32_t{1} << panels_;
    for (int p = 0; p <= panels_; ++p) pairs_.emplace_back(p, panels_);
    ++panels_;
  }
  scratch_.team().for_each(static_cast<int>(pairs_.size()),
                           [&](int turn, int) { multiply(pairs_[turn].first, pairs_[turn].second); });
  return taken;
}

/// The path, and where its fronts lie in the panel.
void TreeColumns::lay_out(Panel& panel, std::span<const BondId> bonds) {
  find_path(tree_, bonds_, bonds, on_path_, panel.path);
  std::int32_t next = 0;
  for (const FrontId f : panel.path) {
    const Front& front = tree_.front[f];
    // Bonds come in the order of their owners, and a subtree is contiguous: so are the lanes that reach it.
    panel.place[f] = {next, bonds_.owned_by(bonds, front.first_descendant, f)};
    next += front.pivots;
    entries_read_ += front.entries();
  }
  fronts_visited_ += static_cast<std::int64_t>(panel.path.size());
  const std::size_t needed = static_cast<std::size_t>(next) * kLanes;
  if (panel.rows.size() < needed) {
    panel.rows.clear();  // nothing to keep
    panel.rows.reserve(needed * 5 / 4);
    panel.rows.resize(needed);
  }
}

/// Parts side by side, then the top, where threads share the rows of a front.
void TreeColumns::solve(Panel& panel, std::span<const BondId> bonds) {
  const TreeScratch::Loan loan(scratch_);
  double* const work = loan.data();
  lay_out(panel, bonds);
  scratch_.parts().split(panel.path, parts_, top_);
  scratch_.team().for_each(static_cast<int>(parts_.size()), [&](int turn, int member) {
    solve_part(panel, bonds, parts_[turn], member, loan);
  });
  for (std::size_t lane = 0; lane < bonds.size(); ++lane) {
    if (!scratch_.parts().is_top(bonds_.owner[bonds[lane]])) continue;
    for (int i = 0; i < bonds_.width; ++i) {
      work[static_cast<std::size_t>(bonds_.rows(bonds[lane])[i]) * kLanes + lane] +=
          bonds_.values(bonds[lane])[i];
    }
  }
  for (std::size_t i = 0; i < top_.size(); ++i) {
    const FrontId f = top_[i];
    const FrontBlock block = factor_.block(f, top_[std::min(i + 1, top_.size() - 1)]);
    double* const pivots = work + static_cast<std::size_t>(tree_.front[f].first) * kLanes;
    const LaneRange& lanes = panel.place[f].lanes;
    if (lanes.size() > 1 && scratch_.shares(tree_.front[f].entries() * lanes.size())) {
      solve_together(block, pivots, work, lanes);
    } else {
      solve_alone(block, pivots, work, lanes, 0);
    }
    keep(panel, f, pivots);
  }
}

/// In the member's own memory, as kernels write lanes that are other parts'. What is left for the top goes there in the
/// part's own lanes.
void TreeColumns::solve_part(Panel& panel, std::span<const BondId> bonds, const PartOfPath& at, int member,
                             const TreeScratch::Loan& loan) {
  const TreePart& part = scratch_.parts().part[at.part];
  const LaneRange lanes = bonds_.owned_by(bonds, part.first, part.root);
  double* const local = loan.local(member);
  for (int lane = lanes.begin; lane < lanes.end; ++lane) {
    const auto values = bonds_.values(bonds[lane]);
    for (int i = 0; i < bonds_.width; ++i) {
      if (values[i] == 0) continue;  // its row is none of the bond's
      const Position row = local_position(tree_, part, bonds_.rows(bonds[lane])[i]);
      local[static_cast<std::size_t>(row) * kLanes + lane] += values[i];
    }
  }
  for (std::int32_t i = at.begin; i < at.end; ++i) {
    const FrontId f = panel.path[i];
    FrontBlock block = factor_.block(f, panel.path[std::min(i + 1, at.end - 1)]);
    block.row = scratch_.parts().local_row.data() + tree_.front[f].rows;
    double* const pivots = local + static_cast<std::size_t>(tree_.front[f].first - part.begin) * kLanes;
    solve_alone(block, pivots, local, panel.place[f].lanes, member);
    keep(panel, f, pivots);
  }
  double* left = local + static_cast<std::size_t>(part.size()) * kLanes;
  for (const Position row : tree_.boundary(part.root)) {
    std::copy(left + lanes.begin, left + lanes.end,
              loan.data() + static_cast<std::size_t>(row) * kLanes + lanes.begin);
    std::fill_n(left, kLanes, 0.0);
    left += kLanes;
  }
}

void TreeColumns::solve_alone(const FrontBlock& block, double* pivots, double* x, const LaneRange& lanes,
                              int member) {
  if (lanes.size() == 1) {
    kernels_.forward_one(block, pivots + lanes.begin, x + lanes.begin, column_[member].data());
  } else {
    kernels_.forward(block, pivots, x, lanes.begin, lanes.end);
  }
}

/// Keeps what was solved, and leaves zeros.
void TreeColumns::keep(Panel& panel, FrontId f, double* pivots) {
  const int size = tree_.front[f].pivots * kLanes;
  std::copy_n(pivots, size, panel.rows.data() + static_cast<std::size_t>(panel.place[f].offset) * kLanes);
  std::fill_n(pivots, size, 0.0);
}

/// The same as the kernel `forward`, to the bit: some pivots, then all rows below them at once, and so on.
void TreeColumns::solve_together(const FrontBlock& block, double* pivots, double* x, const LaneRange& lanes) {
  const int rows = block.pivots + block.boundary;
  for (int begin = 0; begin < block.pivots; begin += kColumnsTogether) {
    const int end = std::min(begin + kColumnsTogether, block.pivots);
    kernels_.forward_rows(block, pivots, x, lanes, begin, end, begin, end);
    const int share = share_of_rows(rows - end, scratch_.team().threads());
    scratch_.team().for_each((rows - end + share - 1) / share, [&](int turn, int) {
      const int first = end + turn * share;
      kernels_.forward_rows(block, pivots, x, lanes, begin, end, first, std::min(first + share, rows));
    });
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
    if (at_left.lanes.size() <= at_right.lanes.size()) {
      kernels_.gram(rows_left + at_left.lanes.begin, at_left.lanes.size(), rows_right, weight, pivots,
                    by_left.data() + at_left.lanes.begin * kLanes, kLanes);
    } else {
      kernels_.gram(rows_right + at_right.lanes.begin, at_right.lanes.size(), rows_left, weight, pivots,
                    by_right.data() + at_right.lanes.begin * kLanes, kLanes);
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

/// The columns of a panel that take part and reach the front.
PanelPart TreeColumns::part_at(FrontId f, int p) const {
  const Place& place = panel_[p].place[f];
  std::int32_t first = used_start_[p];
  std::int32_t last = used_start_[p + 1];
  while (first < last && used_lane_[first] < place.lanes.begin) ++first;
  while (first < last && used_lane_[last - 1] >= place.lanes.end) --last;
  return {panel_[p].rows.data() + static_cast<std::size_t>(place.offset) * kLanes, used_lane_.data() + first,
          spread_.data() + static_cast<std::size_t>(first) * kLanes, last - first};
}

bool TreeColumns::takes_part(FrontId f, std::uint32_t panels) const {
  for (; panels != 0; panels &= panels - 1) {
    if (part_at(f, std::countr_zero(panels)).columns > 0) return true;
  }
  return false;
}

/// act(front, part, parts), on any thread, for every front that columns of the combination reach, and the plate's; these
/// become `fronts`, ascending.
template <class Act>
void TreeColumns::for_each_front(std::vector<FrontId>& fronts, const Act& act) {
  std::uint32_t used = 0;
  for (int p = 0; p < panels_; ++p) {
    if (used_start_[p] < used_start_[p + 1]) used |= std::uint32_t{1} << p;
  }
  const FrontId plate = tree_.fronts() - 1;
  fronts.clear();
  for (FrontId f = 0; f <= plate; ++f) {
    if (f == plate || takes_part(f, panels_at_[f] & used)) fronts.push_back(f);
  }
  const int turns = (static_cast<int>(fronts.size()) + kFrontsTogether - 1) / kFrontsTogether;
  scratch_.team().for_each(turns, [&](int turn, int) {
    std::array<PanelPart, kMost / kLanes> part;
    // the last fronts are the largest
    const int end = static_cast<int>(fronts.size()) - turn * kFrontsTogether;
    for (int i = std::max(0, end - kFrontsTogether); i < end; ++i) {
      int parts = 0;
      for (std::uint32_t panels = panels_at_[fronts[i]] & used; panels != 0; panels &= panels - 1) {
        part[parts] = part_at(fronts[i], std::countr_zero(panels));
        if (part[parts].columns > 0) ++parts;
      }
      act(fronts[i], part.data(), parts);
    }
  });
}

void TreeColumns::combine(std::span<const int> columns, const double* coefficient, double* x,
                          std::vector<FrontId>& fronts) {
  assert(std::ranges::all_of(columns, [this](int c) { return c >= 0 && c < size() && bond_[c] >= 0; }));
  spread(columns, coefficient);
  for_each_front(fronts, [&](FrontId f, const PanelPart* part, int parts) {
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
  for_each_front(fronts, [&](FrontId f, const PanelPart* part, int parts) {
    kernels_.combine_single(part, parts, factor_.inverse_pivots(f), tree_.front[f].pivots,
                            x + static_cast<std::size_t>(tree_.front[f].first) * lanes, lanes);
  });
}

}  // namespace crackle
