/// Which bonds are near a bond, by hops along bonds that can stretch.
#pragma once

#include <vector>

#include "crackle/network/network.hpp"

namespace crackle {

class Neighbourhood {
 public:
  explicit Neighbourhood(const Network& network);

  /// The bonds that touch a node at most `hops` hops from either end of `e`, `e` included, the nearer first:
  /// ring[h] of them need h hops or fewer. Both are replaced.
  void find(BondId e, int hops, std::vector<BondId>& near, std::vector<std::size_t>& ring);

 private:
  const Network& network_;
  std::vector<std::int32_t> start_;  // [N + 1]
  std::vector<BondId> touching_;     // bonds at each node
  std::vector<NodeId> node_;         // workspace of find
  std::vector<std::uint8_t> seen_node_;
  std::vector<std::uint8_t> seen_bond_;
};

}  // namespace crackle
