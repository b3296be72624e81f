/// What bonds make of displacements, in twice the digits of double, by sums and products that keep what rounding takes.
///
/// The same bits on every processor, with and without fused multiply-add.
/// Source: T. J. Dekker, Numer. Math. 18 (1971) 224; T. Ogita, S. M. Rump, S. Oishi, SIAM J. Sci. Comput. 26 (2005) 1955.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/network/network.hpp"
#include "crackle/network/quad_bonds.hpp"

namespace crackle {

/// Of displacements v, the plate's being 1.
struct TwiceSums {
  double energy = 0;   ///< sum of k (b . v)^2: F, when v is in equilibrium
  double largest = 0;  ///< force, k |b . v|
  double terms =
      0;  ///< largest sum of the terms |k b_i v_i| that a force is made of: its rounding is a part of that
};

class TwiceBonds {
 public:
  /// bonds: in the network's order of unknowns. network must outlive it. fused: by fused multiply-adds; must be false
  /// where can_fuse() is.
  TwiceBonds(const Network& network, const QuadBonds& bonds, bool fused = can_fuse());

  /// Whether this processor has them.
  [[nodiscard]] static bool can_fuse();

  /// load = -K v (size n each, v = high + low), force[e] = k b . v, 0 for a bond with broken[e] != 0 (size M each). K is
  /// that of all unknowns, the plate among them.
  TwiceSums fill(std::span<const std::uint8_t> broken, std::span<const double> high,
                 std::span<const double> low, std::span<double> load, std::span<double> force);

  /// Relative error of what fill sums up, in parts of TwiceSums::terms.
  static constexpr double kRounding = 0x1p-104;

 private:
  const Network& network_;
  bool fused_;
  std::vector<double> high_, low_;  ///< [M * width] b
  std::vector<double> rest_;        ///< [n] workspace: what rounding took from load
};

}  // namespace crackle
