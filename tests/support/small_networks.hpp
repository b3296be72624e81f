/// Networks small enough to be worked out by hand, and one of each kind for what holds in all of them.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "crackle/network/disorder.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/network/network.hpp"

namespace crackle::test {

using Bonds = std::vector<std::array<NodeId, 2>>;

/// Fuses between `nodes` nodes one above the other: node 0 is the lower bus bar, the last one the upper.
/// Several bonds may join the same two nodes.
inline Network fuses_between(NodeId nodes, Bonds bonds, std::vector<double> stiffness = {}) {
  std::vector<Vector2> position;
  for (NodeId node = 0; node < nodes; ++node) position.push_back({0, static_cast<double>(node)});
  std::vector<Grip> grip(position.size(), Grip::free);
  grip.front() = Grip::bottom;
  grip.back() = Grip::top;
  return make_network(make_lattice(0, std::move(position), std::move(grip), std::move(bonds)), Model::fuse,
                      Grips::sliding, std::move(stiffness));
}

/// Fuses side by side.
inline Network bundle(std::size_t fuses, std::vector<double> stiffness = {}) {
  return fuses_between(2, Bonds(fuses, {0, 1}), std::move(stiffness));
}

/// Fuses one after the other.
inline Network chain(NodeId fuses) {
  Bonds bonds;
  for (NodeId i = 0; i < fuses; ++i) bonds.push_back({i, i + 1});
  return fuses_between(fuses + 1, std::move(bonds));
}

/// Two springs in line from the origin up along (x, 1): the middle node is free to move across them. Under
/// clamped grips F is 1/2 / (1 + x^2); under sliding ones nothing balances the sideways pull and the plate is
/// loose.
inline Network inclined_chain(Grips grips, double x = 0.5) {
  return make_network(
      make_lattice(0, {{0, 0}, {x, 1}, {2 * x, 2}}, {Grip::bottom, Grip::free, Grip::top}, {{0, 1}, {1, 2}}),
      Model::spring, grips, {});
}

/// The triangular lattice of size 5 in which node 14 hangs on one bond, or on none.
inline Network with_node_hanging(bool hanging) {
  const Lattice lattice = triangular_lattice(5, 1);
  std::vector<double> stiffness(lattice.bond.size(), 1.0);
  bool first = hanging;
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    if (lattice.bond[e][0] != 14 && lattice.bond[e][1] != 14) continue;
    stiffness[e] = first ? 1 : 0;
    first = false;
  }
  return make_network(lattice, Model::spring, Grips::sliding, stiffness);
}

/// A network and what to call it when something fails.
struct NamedNetwork {
  std::string name;
  Network network;
};

/// The triangular lattice of size L with every model and every kind of grip, and once with stiffnesses
/// between 0.5 and 1.5.
inline std::vector<NamedNetwork> triangular_networks(int size) {
  const Lattice lattice = triangular_lattice(size, 1);
  std::vector<double> stiffness(lattice.bond.size());
  draw_uniform_thresholds(99, 0, stiffness);
  for (double& k : stiffness) k += 0.5;
  std::vector<NamedNetwork> networks;
  networks.push_back({"fuses", make_network(lattice, Model::fuse, Grips::sliding, {})});
  networks.push_back({"sliding springs", make_network(lattice, Model::spring, Grips::sliding, {})});
  networks.push_back({"clamped springs", make_network(lattice, Model::spring, Grips::clamped, {})});
  networks.push_back({"uneven springs", make_network(lattice, Model::spring, Grips::sliding, stiffness)});
  return networks;
}

/// F of the intact triangular lattice: every inclined bond stretches alike, the horizontal ones not at all.
/// The stretch of a bond of direction (+-1, 2)/sqrt(5) counts 4/5, a fuse's voltage drop counts whole.
inline double intact_stiffness(int size, Model model) {
  const double bond = model == Model::fuse ? 1.0 : 0.8;
  return 2 * bond * (size + 1) / size;
}

/// Values that differ from one another, between -0.5 and 0.5.
inline std::vector<double> mixed_values(std::size_t size, std::uint64_t seed = 7) {
  std::vector<double> values(size);
  draw_uniform_thresholds(seed, 0, values);
  for (double& value : values) value -= 0.5;
  return values;
}

}  // namespace crackle::test
