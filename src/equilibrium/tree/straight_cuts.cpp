#include "crackle/equilibrium/tree/straight_cuts.hpp"

#include <algorithm>
#include <cmath>

namespace crackle {

namespace {

constexpr std::int32_t kNone = -1;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// How far from the median lines are tried. Further ones leave parts too unequal for what they save.
constexpr std::int32_t kAside = 3;
/// Ranks hardly repeat: but for a coordinate that many nodes share, one line is like the next.
constexpr std::int32_t kAsideInRanks = 1;
/// Columns plus rows that a bond of a lattice spans at most.
constexpr std::int32_t kReach = 2 * kLongestStep;
/// What a front costs besides its entries, in entries: small leaves fill little and take time.
constexpr double kFront = 200;
/// Entries of a part's factor, see StraightCuts. The part linear in n makes a dense triangle of 16 unknowns.
constexpr double kByUnknowns = 1;
constexpr double kByTouched = 2;
constexpr double kLinear = 8.5 + kFront / 16 - 4 * kByUnknowns;

}  // namespace

void StraightCuts::Span::include(std::int32_t value) {
  lowest = std::min(lowest, value);
  highest = std::max(highest, value);
}

StraightCuts::StraightCuts(const UnknownGraph& graph, int leaf_unknowns)
    : graph_(graph),
      leaf_(leaf_unknowns),
      aside_(graph.lattice ? kAside : kAsideInRanks),
      place_(graph.place),
      region_(graph.unknowns(), kNone),
      number_(graph.unknowns(), kNone) {}

/// In a ring of a lattice that counts columns, modulo the period: the ring begins and ends at a slanted line.
std::int32_t StraightCuts::along(Line line, Dof i) const {
  const std::int32_t value = line.x * place_[i].x + line.y * place_[i].y;
  if (!wrapped_ || line.x == 0 || !graph_.lattice) return value;
  const std::int32_t rest = value % graph_.columns;
  return rest < 0 ? rest + graph_.columns : rest;
}

bool StraightCuts::cut(std::span<const Dof> region, bool& wrapped, std::vector<Dof>& around,
                       std::span<Side> side) {
  ++number_of_region_;
  for (const Dof i : region) region_[i] = number_of_region_;
  wrapped_ = wrapped;
  std::erase_if(around, [&](Dof outside) {
    return std::ranges::none_of(graph_.neighbours(outside),
                                [&](Dof i) { return region_[i] == number_of_region_; });
  });
  around_ = around;
  best_.entries = kInfinite;
  for (const Line line : std::span(kLines).first(graph_.lattice ? 4 : 2)) try_lines(region, line);
  if (best_.entries == kInfinite) return false;
  write_sides(region, side);
  around.insert(around.end(), best_.unknown.begin(), best_.unknown.end());
  if (wrapped && best_.line.x != 0) {
    unwrap(region);
    wrapped = false;
  }
  return true;
}

void StraightCuts::try_lines(std::span<const Dof> region, Line line) {
  line_ = line;
  value_.clear();
  values_ = {};
  for (const Dof i : region) {
    value_.push_back(along(line, i));
    values_.include(value_.back());
  }
  const std::int32_t middle = median();
  find_reach();
  find_near(region, middle);
  const std::int32_t lowest = std::max(values_.lowest, middle - aside_);
  const std::int32_t highest = std::min(values_.highest - 1, middle + aside_);
  times_.assign(2 * static_cast<std::size_t>(aside_) + 1, 0);
  std::int64_t first = 0;
  for (const std::int32_t value : value_) {
    if (value < lowest) {
      ++first;
    } else if (value <= highest) {
      ++times_[value - lowest];
    }
  }
  for (std::int32_t last = lowest; last <= highest; ++last) {
    const std::int64_t more = times_[last - lowest];
    first += more;
    // a line beside the one before with nothing between them is no other
    if (more > 0 || last == lowest) try_line(last, first, static_cast<std::int64_t>(region.size()) - first);
  }
}

/// By counting where values are few, as in a lattice.
std::int32_t StraightCuts::median() {
  const std::size_t half = value_.size() / 2;
  const std::int64_t range = static_cast<std::int64_t>(values_.highest) - values_.lowest + 1;
  if (range > static_cast<std::int64_t>(value_.size())) {
    sorted_ = value_;
    std::ranges::nth_element(sorted_, sorted_.begin() + static_cast<std::ptrdiff_t>(half));
    return sorted_[half];
  }
  times_.assign(static_cast<std::size_t>(range), 0);
  for (const std::int32_t value : value_) ++times_[value - values_.lowest];
  std::int32_t middle = values_.lowest;
  auto up_to = static_cast<std::size_t>(times_[0]);
  while (up_to <= half) up_to += static_cast<std::size_t>(times_[++middle - values_.lowest]);
  return middle;
}

void StraightCuts::find_reach() {
  reach_.clear();
  for (const Dof outside : around_) {
    Span values;
    for (const Dof i : graph_.neighbours(outside)) {
      if (region_[i] == number_of_region_) values.include(along(line_, i));
    }
    reach_.push_back(values);
  }
}

/// A line that opens a ring cuts it at the period, too: where values begin.
void StraightCuts::find_near(std::span<const Dof> region, std::int32_t middle) {
  if (!graph_.lattice) {
    near_.assign(region.begin(), region.end());
    return;
  }
  near_.clear();
  const std::int32_t begin = wrapped_ && line_.x != 0 ? values_.lowest + kReach : values_.lowest;
  for (std::size_t i = 0; i < region.size(); ++i) {
    const std::int32_t value = value_[i];
    if (value < begin || (value > middle - aside_ - kReach && value <= middle + aside_))
      near_.push_back(region[i]);
  }
}

void StraightCuts::try_line(std::int32_t last, std::int64_t first, std::int64_t second) {
  find_coupled_pairs(last);
  const VertexCover cover = least_vertex_cover(pairs_);
  const std::int64_t before = first - static_cast<std::int64_t>(cover.left.size());
  const std::int64_t after = second - static_cast<std::int64_t>(cover.right.size());
  if (before == 0 || after == 0) return;
  const double entries = foresee(cover, last, before, after);
  if (!(entries < best_.entries)) return;
  best_.entries = entries;
  best_.line = line_;
  best_.last = last;
  best_.unknown.clear();
  for (const std::int32_t i : cover.left) best_.unknown.push_back(left_[i]);
  for (const std::int32_t j : cover.right) best_.unknown.push_back(right_[j]);
}

void StraightCuts::find_coupled_pairs(std::int32_t last) {
  pairs_.start.assign(1, 0);
  pairs_.right.clear();
  left_.clear();
  right_.clear();
  for (const Dof i : near_) {
    if (along(line_, i) > last) continue;
    const std::size_t before = pairs_.right.size();
    for (const Dof j : graph_.neighbours(i)) {
      if (region_[j] != number_of_region_ || along(line_, j) <= last) continue;
      if (number_[j] == kNone) {
        number_[j] = static_cast<std::int32_t>(right_.size());
        right_.push_back(j);
      }
      pairs_.right.push_back(number_[j]);
    }
    if (pairs_.right.size() == before) continue;
    left_.push_back(i);
    pairs_.start.push_back(static_cast<std::int32_t>(pairs_.right.size()));
  }
  pairs_.rights = static_cast<std::int32_t>(right_.size());
  for (const Dof j : right_) number_[j] = kNone;
}

double StraightCuts::entries_of_part(std::int64_t unknowns, std::int64_t touched) const {
  const auto n = static_cast<double>(unknowns);
  const auto b = static_cast<double>(touched);
  if (unknowns <= leaf_) return kFront + n * (n + 1) / 2 + n * b;
  return n * (kByUnknowns * std::log2(n) + kLinear) + kByTouched * b * std::sqrt(n);
}

double StraightCuts::foresee(const VertexCover& cover, std::int32_t last, std::int64_t before,
                             std::int64_t after) const {
  const auto separator = static_cast<std::int64_t>(cover.left.size() + cover.right.size());
  std::int64_t touched_before = separator;
  std::int64_t touched_after = separator;
  for (const Span& reach : reach_) {
    touched_before += reach.lowest <= last ? 1 : 0;
    touched_after += reach.highest > last ? 1 : 0;
  }
  const auto s = static_cast<double>(separator);
  return s * (s + 1) / 2 + s * static_cast<double>(around_.size()) + entries_of_part(before, touched_before) +
         entries_of_part(after, touched_after);
}

void StraightCuts::write_sides(std::span<const Dof> region, std::span<Side> side) {
  for (const Dof i : best_.unknown) number_[i] = 0;
  for (std::size_t k = 0; k < region.size(); ++k) {
    const Dof i = region[k];
    side[k] = number_[i] != kNone                  ? Side::separator
              : along(best_.line, i) <= best_.last ? Side::first
                                                   : Side::second;
  }
  for (const Dof i : best_.unknown) number_[i] = kNone;
}

/// Moves columns by periods so that the region lies between its two cuts.
void StraightCuts::unwrap(std::span<const Dof> region) {
  if (!graph_.lattice) return;
  for (const Dof i : region) place_[i].x = along(best_.line, i) - best_.line.y * place_[i].y;
}

}  // namespace crackle
