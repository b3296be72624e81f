#include "crackle/equilibrium/tree/tree_followed.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crackle {

namespace {

constexpr std::size_t kMostFirst = 64;   // best-ranked bonds in the set,
constexpr std::size_t kLeastFirst = 16;  // fewer in small networks:
constexpr std::size_t kBondsPerFirst = 150;
// A bond near one that breaks joins the set if its ratio would come this near to the largest,
constexpr double kNearRatio = 0.9;
// were it to take over a share of the force that the break sets free: bonds that touch the broken one, those a hop
// away, two hops. Nine in ten of the breaks that a set without them misses are among the first two rings.
constexpr std::array<double, 3> kShare{0.5, 0.25, 0.1};
constexpr int kHops = 2;
constexpr int kHopsWhenSmall = 1;  // in a small network it is not worth while to look further

}  // namespace

TreeFollowed::TreeFollowed(const Network& network, const TreeSearch& search, const TreeColumns& columns)
    : search_(search),
      columns_(columns),
      neighbourhood_(network),
      first_(std::clamp(static_cast<std::size_t>(network.stretchable) / kBondsPerFirst, kLeastFirst,
                        kMostFirst)),
      hops_(first_ < kMostFirst ? kHopsWhenSmall : kHops),
      in_set_(network.bonds(), 0) {}

void TreeFollowed::clear() {
  for (int c = 0; c < columns_.size(); ++c) {
    if (columns_.bond(c) >= 0) in_set_[columns_.bond(c)] = 0;
  }
}

void TreeFollowed::choose(std::span<const BondId> fresh, Ranking ranked, const CertainState& last) {
  list_.clear();
  for (const BondId e : fresh) take(e);
  const std::size_t first = std::min(first_, ranked.size());
  take_ranked(ranked, 0, first);
  // What earlier breaks did to the forces around them is known; the last one's effect is not.
  if (!fresh.empty() && !ranked.empty()) take_near(fresh.back(), last.force, last);
  fill_panel(ranked, first);
}

void TreeFollowed::extend(const Prediction& prediction, Ranking ranked, const CertainState& last) {
  list_.clear();
  for (int s = 0; s < prediction.states && !ranked.empty(); ++s) {
    take_near(prediction.bond[s], last.ratio * search_.threshold(prediction.bond[s]), last);
  }
  fill_panel(ranked, first_);
}

/// A panel costs the same full or not: the next in rank may come along.
void TreeFollowed::fill_panel(Ranking ranked, std::size_t begin) {
  for (; list_.size() % kLanes != 0 && begin < ranked.size(); ++begin) take_ranked(ranked, begin, begin + 1);
}

void TreeFollowed::take_ranked(Ranking ranked, std::size_t begin, std::size_t end) {
  for (const auto& [ratio, bond] : ranked.subspan(begin, end - begin)) {
    if (std::isfinite(search_.threshold(bond))) take(bond);
  }
}

void TreeFollowed::choose_also(std::span<const BondId> bonds, Ranking ranked, const CertainState& last) {
  list_.clear();
  for (const BondId e : bonds) take(e);
  // Most likely the first of them is what breaks next: the panel is as well filled with those near it.
  for (const BondId e : bonds) take_near(e, search_.ratio(e, last.state) * search_.threshold(e), last);
  const std::size_t panel = kLanes;
  while (list_.size() > std::max(panel, bonds.size())) {
    in_set_[list_.back()] = 0;
    list_.pop_back();
  }
  fill_panel(ranked, 0);
}

void TreeFollowed::take(BondId e) {
  if (in_set_[e] != 0 || static_cast<int>(list_.size()) + columns_.size() >= TreeColumns::kMost) return;
  in_set_[e] = 1;
  list_.push_back(e);
}

/// Bonds near one that breaks, if its force, passed on, could make them critical. (Somebody is ranked: a state has been
/// solved for.)
void TreeFollowed::take_near(BondId e, double force, const CertainState& last) {
  neighbourhood_.find(e, hops_, near_, ring_);
  std::size_t i = 0;
  for (int ring = 0; ring <= hops_; ++ring) {
    const double added = kShare[ring] * force;
    for (; i < ring_[ring]; ++i) {
      const BondId other = near_[i];
      if (in_set_[other] != 0) continue;
      const double t = search_.threshold(other);
      if (last.listed + added / t < kNearRatio * last.ratio) continue;
      if (search_.ratio(other, last.state) + added / t > kNearRatio * last.ratio) take(other);
    }
  }
}

}  // namespace crackle
