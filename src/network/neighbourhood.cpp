#include "crackle/network/neighbourhood.hpp"

namespace crackle {

Neighbourhood::Neighbourhood(const Network& network)
    : network_(network),
      start_(static_cast<std::size_t>(network.lattice.nodes()) + 1, 0),
      seen_node_(network.lattice.nodes(), 0),
      seen_bond_(network.bonds(), 0) {
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    for (const NodeId node : network.lattice.bond[e]) ++start_[node + 1];
  }
  for (NodeId node = 0; node < network.lattice.nodes(); ++node) start_[node + 1] += start_[node];
  touching_.resize(start_.back());
  std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
  for (BondId e = 0; e < network.bonds(); ++e) {
    if (!network.can_stretch(e)) continue;
    for (const NodeId node : network.lattice.bond[e]) touching_[next[node]++] = e;
  }
}

void Neighbourhood::find(BondId e, int hops, std::vector<BondId>& near, std::vector<std::size_t>& ring) {
  near.clear();
  ring.clear();
  node_.assign(network_.lattice.bond[e].begin(), network_.lattice.bond[e].end());
  for (const NodeId node : node_) seen_node_[node] = 1;
  std::size_t begin = 0;
  for (int hop = 0; hop <= hops; ++hop) {
    const std::size_t end = node_.size();
    for (; begin < end; ++begin) {
      for (std::int32_t i = start_[node_[begin]]; i < start_[node_[begin] + 1]; ++i) {
        const BondId bond = touching_[i];
        if (seen_bond_[bond] == 0) near.push_back(bond);
        seen_bond_[bond] = 1;
        for (const NodeId node : network_.lattice.bond[bond]) {
          if (seen_node_[node] == 0) node_.push_back(node);
          seen_node_[node] = 1;
        }
      }
    }
    ring.push_back(near.size());
  }
  for (const NodeId node : node_) seen_node_[node] = 0;
  for (const BondId bond : near) seen_bond_[bond] = 0;
}

}  // namespace crackle
