/// The smallest set of vertices that meets every edge of a bipartite graph: the thinnest separator along a cut.
///
/// Sources: D. König, Matematikai és Fizikai Lapok 38 (1931) 116 (cover from a maximum matching); J. Hopcroft &
/// R. Karp, SIAM J. Comput. 2 (1973) 225 (the layered search for augmenting paths).
#pragma once

#include <cstdint>
#include <vector>

namespace crackle {

/// Vertices of one side and, in compressed rows, those of the other side that they are coupled with.
struct CoupledPairs {
  std::vector<std::int32_t> start{0};  ///< [lefts + 1]
  std::vector<std::int32_t> right;     ///< [edges]
  std::int32_t rights = 0;             ///< how many there are on the other side

  [[nodiscard]] std::int32_t lefts() const { return static_cast<std::int32_t>(start.size()) - 1; }
};

struct VertexCover {
  std::vector<std::int32_t> left;   ///< ascending
  std::vector<std::int32_t> right;  ///< ascending
};

[[nodiscard]] VertexCover least_vertex_cover(const CoupledPairs& pairs);

}  // namespace crackle
