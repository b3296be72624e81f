#include "crackle/network/network.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <utility>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

/// Components of a bond's direction below this are neither 0 nor anything whose square is a stiffness in double.
constexpr double kLeastDirection = 1e-140;

void check_stiffness(const Network& network) {
  if (network.stiffness.size() != network.lattice.bond.size()) {
    throw InputError("number of stiffnesses", std::to_string(network.stiffness.size()),
                     "one for each of the " + std::to_string(network.bonds()) + " bonds");
  }
  for (BondId e = 0; e < network.bonds(); ++e) {
    const double k = network.stiffness[e];
    if (!(k >= 0) || std::isinf(k)) {
      throw InputError("stiffness of bond " + std::to_string(e), std::to_string(k), "a number from 0");
    }
  }
}

/// Union-find over the bonds that have stiffness; each grip is one body.
void check_path(const Network& network) {
  const Lattice& lattice = network.lattice;
  const NodeId bottom = lattice.nodes();
  const NodeId top = bottom + 1;
  std::vector<NodeId> parent(static_cast<std::size_t>(lattice.nodes()) + 2);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&parent](NodeId node) {
    while (parent[node] != node) node = parent[node] = parent[parent[node]];
    return node;
  };
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    if (lattice.grip[node] != Grip::free) parent[root(node)] = lattice.grip[node] == Grip::top ? top : bottom;
  }
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (network.stiffness[e] > 0) parent[root(lattice.bond[e][0])] = root(lattice.bond[e][1]);
  }
  if (root(bottom) != root(top)) {
    throw InputError("network", "", "one in which a path of bonds with stiffness joins the two grips");
  }
}

/// What the grips do to one component (0: x, 1: y; a fuse has only the load's) of a node.
enum class Hold : std::uint8_t { free, fixed, plate };

Hold hold(const Network& network, NodeId node, int component, NodeId pinned) {
  const Grip grip = network.lattice.grip[node];
  const bool along_load = component == network.components - 1;
  if (grip == Grip::free) return Hold::free;
  if (along_load) return grip == Grip::top ? Hold::plate : Hold::fixed;
  return network.grips == Grips::clamped || node == pinned ? Hold::fixed : Hold::free;
}

void number_unknowns(Network& network) {
  const Lattice& lattice = network.lattice;
  const int components = network.components;
  const auto first_bottom = std::ranges::find(lattice.grip, Grip::bottom) - lattice.grip.begin();
  const auto pinned = static_cast<NodeId>(first_bottom);
  network.dof.assign(static_cast<std::size_t>(lattice.nodes()) * components, Network::kFixed);
  std::vector<std::size_t> on_plate;
  Dof next = 0;
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    const Dof start = next;
    bool any = false;
    for (int c = 0; c < components; ++c) {
      const std::size_t slot = static_cast<std::size_t>(node) * components + c;
      const Hold held = hold(network, node, c, pinned);
      if (held == Hold::plate) on_plate.push_back(slot);
      if (held != Hold::free) continue;
      network.dof[slot] = start + c;
      any = true;
    }
    if (any) next += components;
  }
  network.unknowns = next + components;
  network.plate = network.unknowns - 1;
  for (const std::size_t slot : on_plate) network.dof[slot] = network.plate;
}

/// Writes b_e: the direction at the second node, minus it at the first; fixed components left out, the
/// plate's two entries merged.
void fill_bond(Network& network, BondId e) {
  const std::size_t first = static_cast<std::size_t>(e) * network.width();
  int filled = 0;
  for (const int end : {0, 1}) {
    const NodeId node = network.lattice.bond[e][end];
    const Vector2 d = network.lattice.direction[e];
    for (int c = 0; c < network.components; ++c) {
      const Dof dof = network.dof[static_cast<std::size_t>(node) * network.components + c];
      const double along = network.components == 1 ? 1.0 : c == 0 ? d.x : d.y;
      const double value = end == 0 ? -along : along;
      if (dof == Network::kFixed || value == 0) continue;
      const auto begin = network.bond_dof.begin() + static_cast<std::ptrdiff_t>(first);
      const auto same = std::find(begin, begin + filled, dof) - begin;
      if (same == filled) network.bond_dof[first + filled++] = dof;
      network.bond_value[first + same] += value;
    }
  }
  int kept = 0;
  for (int i = 0; i < filled; ++i) {
    if (network.bond_value[first + i] == 0) continue;
    network.bond_dof[first + kept] = network.bond_dof[first + i];
    network.bond_value[first + kept++] = network.bond_value[first + i];
  }
  for (int i = kept; i < network.width(); ++i) {
    network.bond_dof[first + i] = 0;
    network.bond_value[first + i] = 0;
  }
}

/// K's diagonal, and the slots that no bond touches.
double note_diagonal(Network& network) {
  std::vector<double> diagonal(network.unknowns, 0.0);
  std::vector<std::uint8_t> touched(network.unknowns, 0);
  for (BondId e = 0; e < network.bonds(); ++e) {
    const auto values = network.bond_values(e);
    for (std::size_t i = 0; i < values.size(); ++i) {
      diagonal[network.bond_dofs(e)[i]] += network.stiffness[e] * values[i] * values[i];
      if (network.can_stretch(e) && values[i] != 0) touched[network.bond_dofs(e)[i]] = 1;
    }
  }
  network.plate_diagonal = diagonal.back();
  network.idle.clear();
  for (Dof slot = 0; slot < network.unknowns; ++slot) {
    if (touched[slot] == 0) network.idle.push_back(slot);
  }
  return 2.0 * network.width() * *std::ranges::max_element(diagonal);
}

/// Whether a bond lies along an axis decides how it carries: a direction must say so, beyond what rounding may do.
void check_directions(const Network& network) {
  for (BondId e = 0; e < network.bonds(); ++e) {
    const Vector2 d = network.lattice.direction[e];
    for (const double part : {d.x, d.y}) {
      if (network.components == 1 || part == 0 || std::abs(part) >= kLeastDirection) continue;
      std::array<char, 40> text{};
      std::snprintf(text.data(), text.size(), "(%.4g, %.4g)", d.x, d.y);
      throw InputError(
          "direction of bond " + std::to_string(e), text.data(),
          "components that are 0 or at least 1e-140 (-lattice_row_spacing, positions of a file)");
    }
  }
}

}  // namespace

Network make_network(Lattice lattice, Model model, Grips grips, std::vector<double> stiffness) {
  Network network;
  network.lattice = std::move(lattice);
  network.model = model;
  network.grips = grips;
  network.components = model == Model::spring ? 2 : 1;
  network.stiffness = std::move(stiffness);
  if (network.stiffness.empty()) network.stiffness.assign(network.lattice.bond.size(), 1.0);
  check_stiffness(network);
  check_path(network);
  check_directions(network);
  number_unknowns(network);
  const std::size_t entries = network.lattice.bond.size() * network.width();
  network.bond_dof.assign(entries, 0);
  network.bond_value.assign(entries, 0.0);
  for (BondId e = 0; e < network.bonds(); ++e) {
    fill_bond(network, e);
    if (network.can_stretch(e)) ++network.stretchable;
  }
  network.norm = note_diagonal(network);
  return network;
}

double energy(const Network& network, std::span<const std::uint8_t> broken, std::span<const double> u) {
  double sum = 0;
  for (BondId e = 0; e < network.bonds(); ++e) {
    const double stretch = broken[e] == 0 ? elongation(network, e, u) : 0;
    sum += network.stiffness[e] * stretch * stretch;
  }
  return sum;
}

double contrast(const Network& network) {
  double stiffest = 0;
  double softest = std::numeric_limits<double>::infinity();
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    stiffest = std::max(stiffest, network.stiffness[e]);
    softest = std::min(softest, network.stiffness[e]);
  }
  return stiffest / softest;
}

BondsAtNode bonds_at(const Network& network, NodeId node) {
  BondsAtNode found = kNoBonds;
  std::size_t count = 0;
  for (BondId e = 0; e < network.bonds() && count < found.size(); ++e) {
    const auto& ends = network.lattice.bond[e];
    if (network.can_stretch(e) && (ends[0] == node || ends[1] == node)) found[count++] = e;
  }
  return found;
}

std::string name_node(NodeId node, const BondsAtNode& bonds) {
  std::string text = "node " + std::to_string(node);
  if (bonds[0] < 0) return text;
  text.append(bonds[1] < 0 ? " (bond " : " (bonds ").append(std::to_string(bonds[0]));
  for (std::size_t i = 1; i < kNamedBonds && bonds[i] >= 0; ++i) text += ", " + std::to_string(bonds[i]);
  return text + (bonds.back() < 0 ? ")" : ", ...)");
}

void residual(const Network& network, std::span<const std::uint8_t> broken, std::span<const double> u,
              std::span<double> r) {
  std::ranges::fill(r, 0.0);
  r[network.plate] = 1;
  for (const Dof slot : network.idle) r[slot] = -u[slot];
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (broken[e] != 0) continue;
    const double force = network.stiffness[e] * elongation(network, e, u);
    const auto dofs = network.bond_dofs(e);
    const auto values = network.bond_values(e);
    for (std::size_t i = 0; i < dofs.size(); ++i) r[dofs[i]] -= values[i] * force;
  }
}

double backward_error(const Network& network, std::span<const std::uint8_t> broken, std::span<const double> u,
                      std::span<double> r) {
  const auto magnitude = [](double x) { return std::abs(x); };
  residual(network, broken, u, r);
  const double largest_r = std::abs(*std::ranges::max_element(r, {}, magnitude));
  const double largest_u = std::abs(*std::ranges::max_element(u, {}, magnitude));
  return largest_r / (1 + network.norm * largest_u);
}

}  // namespace crackle
