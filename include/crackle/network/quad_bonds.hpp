/// The network as a linear system in 113 bits: where its unknowns stand in a narrow profile, and each b_e as the
/// positions of the nodes say it, not as double has rounded it.
///
/// A direction that is rounded to double is off by 1e-16, and so a stiff part that turns as a whole stretches its own
/// bonds by as much: at a contrast of 1e16 that force is no longer small beside those that soft bonds bring.
#pragma once

#include <span>
#include <vector>

#include "crackle/factor/profile_factor.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

/// The order of the unknowns in a factor.
struct QuadOrder {
  std::vector<int> row;    ///< [n] of each unknown; the plate is last
  std::vector<int> first;  ///< [n] of each row: the profile of K
};

/// By the nodes' numbers, heights, or places along x, whichever leaves least work.
[[nodiscard]] QuadOrder find_quad_order(const Network& network);

struct QuadBonds {
  int width = 0;
  std::vector<int> row;     ///< [M * width]
  std::vector<Quad> value;  ///< [M * width]; 0 where there is no entry
  /// Largest angle by which roundings of two nodes' coordinates may have turned a bond; coordinates that are equal, or
  /// need no more than 24 bits, are taken for exact.
  double turned = 0;

  [[nodiscard]] std::span<const int> rows(BondId e) const {
    return {row.data() + static_cast<std::size_t>(e) * width, static_cast<std::size_t>(width)};
  }
  [[nodiscard]] std::span<const Quad> values(BondId e) const {
    return {value.data() + static_cast<std::size_t>(e) * width, static_cast<std::size_t>(width)};
  }
  /// b_e . x, x in the order of rows.
  [[nodiscard]] Quad stretch(BondId e, std::span<const Quad> x) const {
    Quad sum = 0;
    const std::size_t begin = static_cast<std::size_t>(e) * width;
    for (int i = 0; i < width; ++i) sum += value[begin + i] * x[row[begin + i]];
    return sum;
  }
};

/// Where positions, over some image along x, don't give the direction that the network states, that one is taken as
/// it is.
[[nodiscard]] QuadBonds make_quad_bonds(const Network& network, const QuadOrder& order);

[[nodiscard]] inline Quad magnitude(Quad x) {
  return x < 0 ? -x : x;
}

}  // namespace crackle
