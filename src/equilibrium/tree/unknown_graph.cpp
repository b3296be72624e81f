#include "crackle/equilibrium/tree/unknown_graph.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace crackle {

namespace {

/// Columns and rows are whole numbers but for rounding.
constexpr double kRounding = 1e-6;
/// Columns or rows at most: sums of the two are 32-bit integers.
constexpr double kMostColumns = 5e8;
/// Of the free nodes of a lattice that counts as whole, those with all their bonds. METIS's separators wander
/// through gaps: with 2 % of the bonds missing they begin to fill less.
constexpr double kWhole = 0.9;

/// The way of bond e as its nodes' positions have it, to the nearest image.
Vector2 way(const Lattice& lattice, BondId e) {
  const Vector2 from = lattice.position[lattice.bond[e][0]];
  const Vector2 to = lattice.position[lattice.bond[e][1]];
  Vector2 d = lattice.step.empty() ? Vector2{to.x - from.x, to.y - from.y} : lattice.step[e];
  if (lattice.period_x > 0) d.x -= lattice.period_x * std::round(d.x / lattice.period_x);
  return d;
}

/// The shortest steps that bonds make along x and y; rounding is none. Infinite: no bond leads that way.
Vector2 smallest_steps(const Lattice& lattice) {
  const double none = std::numeric_limits<double>::infinity();
  Vector2 step{none, none};
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    const Vector2 d = way(lattice, e);
    const double x = std::abs(d.x);
    const double y = std::abs(d.y);
    if (lattice.direction[e].x != 0 && x > kRounding) step.x = std::min(step.x, x);
    if (lattice.direction[e].y != 0) step.y = std::min(step.y, y);
  }
  return step;
}

std::optional<std::int32_t> whole_number(double value) {
  const double nearest = std::round(value);
  if (!(std::abs(value - nearest) <= kRounding) || std::abs(nearest) > kMostColumns) return std::nullopt;
  return static_cast<std::int32_t>(nearest);
}

/// Columns and rows of the nodes, if all have whole ones and no bond is long; else empty.
std::vector<Place> find_lattice(const Lattice& lattice, std::int32_t& columns) {
  const Vector2 step = smallest_steps(lattice);
  const auto short_step = [](double d, double unit) {
    return d == 0 || std::abs(d) <= (kLongestStep + kRounding) * unit;
  };
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    const Vector2 d = way(lattice, e);
    if (!short_step(d.x, step.x) || !short_step(d.y, step.y)) return {};
  }
  const std::optional<std::int32_t> period = whole_number(lattice.period_x / step.x);
  if (!period || (lattice.period_x > 0 && *period == 0)) return {};
  columns = *period;
  std::vector<Place> places;
  places.reserve(lattice.position.size());
  const Vector2 origin = lattice.position.empty() ? Vector2{} : lattice.position[0];
  for (const Vector2 p : lattice.position) {
    const auto x = whole_number((p.x - origin.x) / step.x);
    const auto y = whole_number((p.y - origin.y) / step.y);
    if (!x || !y) return {};
    places.push_back({*x, *y});
  }
  return places;
}

template <class Coordinate>
std::vector<std::int32_t> ranks(std::span<const Vector2> position, Coordinate coordinate) {
  std::vector<double> sorted;
  sorted.reserve(position.size());
  for (const Vector2 p : position) sorted.push_back(coordinate(p));
  std::ranges::sort(sorted);
  const auto repeated = std::ranges::unique(sorted);
  sorted.erase(repeated.begin(), repeated.end());
  std::vector<std::int32_t> rank;
  rank.reserve(position.size());
  for (const Vector2 p : position) {
    rank.push_back(
        static_cast<std::int32_t>(std::ranges::lower_bound(sorted, coordinate(p)) - sorted.begin()));
  }
  return rank;
}

std::vector<Place> rank_places(const Lattice& lattice) {
  const std::vector<std::int32_t> x = ranks(lattice.position, [](Vector2 p) { return p.x; });
  const std::vector<std::int32_t> y = ranks(lattice.position, [](Vector2 p) { return p.y; });
  std::vector<Place> places(lattice.position.size());
  for (std::size_t node = 0; node < places.size(); ++node) places[node] = {x[node], y[node]};
  return places;
}

/// Whether most free nodes have equally many bonds that can stretch.
bool hardly_misses_a_bond(const Network& network) {
  const Lattice& lattice = network.lattice;
  std::vector<std::int32_t> bonds_at(lattice.nodes(), 0);
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    for (const NodeId node : lattice.bond[e]) ++bonds_at[node];
  }
  std::vector<std::int32_t> nodes_with;
  std::int32_t free = 0;
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    if (lattice.grip[node] != Grip::free) continue;
    ++free;
    const auto bonds = static_cast<std::size_t>(bonds_at[node]);
    if (bonds >= nodes_with.size()) nodes_with.resize(bonds + 1, 0);
    ++nodes_with[bonds];
  }
  return free > 0 && *std::ranges::max_element(nodes_with) >= kWhole * free;
}

void set_places(const Network& network, UnknownGraph& graph) {
  const Lattice& lattice = network.lattice;
  std::vector<Place> of_node = find_lattice(lattice, graph.columns);
  graph.wrapped = lattice.period_x > 0;
  graph.lattice = !of_node.empty();
  graph.whole = graph.lattice && hardly_misses_a_bond(network);
  if (!graph.lattice) of_node = rank_places(lattice);
  graph.place.resize(network.plate);
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    for (int c = 0; c < network.components; ++c) {
      const Dof dof = network.dof[static_cast<std::size_t>(node) * network.components + c];
      if (dof != Network::kFixed && dof != network.plate) graph.place[dof] = of_node[node];
    }
  }
}

/// Bonds that act on each unknown, the plate left out: bond[start[i] .. start[i + 1]).
struct BondsOn {
  std::vector<std::int32_t> start;
  std::vector<BondId> bond;
};

BondsOn bonds_on_unknowns(const Network& network) {
  BondsOn on;
  on.start.assign(static_cast<std::size_t>(network.plate) + 2, 0);
  const auto for_each = [&](auto action) {
    for (BondId e = 0; e < network.bonds(); ++e) {
      if (!network.can_stretch(e)) continue;
      for (int i = 0; i < network.width(); ++i) {
        const Dof dof = network.bond_dofs(e)[i];
        if (network.bond_values(e)[i] != 0 && dof != network.plate) action(dof, e);
      }
    }
  };
  for_each([&](Dof dof, BondId /*e*/) { ++on.start[dof + 2]; });
  for (Dof i = 0; i < network.plate; ++i) on.start[i + 2] += on.start[i + 1];
  on.bond.resize(on.start.back());
  for_each([&](Dof dof, BondId e) { on.bond[on.start[dof + 1]++] = e; });
  on.start.pop_back();
  return on;
}

}  // namespace

UnknownGraph make_unknown_graph(const Network& network) {
  UnknownGraph graph;
  set_places(network, graph);
  graph.on_plate.assign(graph.unknowns(), 0);
  graph.start.reserve(static_cast<std::size_t>(graph.unknowns()) + 1);
  graph.start.push_back(0);
  const BondsOn on = bonds_on_unknowns(network);
  std::vector<Dof> seen(graph.unknowns(), -1);
  for (Dof i = 0; i < graph.unknowns(); ++i) {
    seen[i] = i;
    for (std::int32_t at = on.start[i]; at < on.start[i + 1]; ++at) {
      for (int j = 0; j < network.width(); ++j) {
        const Dof other = network.bond_dofs(on.bond[at])[j];
        if (network.bond_values(on.bond[at])[j] == 0) continue;
        if (other == network.plate) {
          graph.on_plate[i] = 1;
        } else if (seen[other] != i) {
          seen[other] = i;
          graph.neighbour.push_back(other);
        }
      }
    }
    std::sort(graph.neighbour.begin() + graph.start.back(), graph.neighbour.end());
    graph.start.push_back(static_cast<std::int32_t>(graph.neighbour.size()));
  }
  return graph;
}

}  // namespace crackle
