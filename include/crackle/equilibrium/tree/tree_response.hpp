/// A small network by the responses of the intact one alone: every bond followed, no factor touched.
///
/// G0 = g^T K0^-1 g over all bonds, g_e = sqrt(k_e) b_e, is made once and serves all samples. With s_e = g_e . u at unit
/// plate load, a break of bond j does (Sherman-Morrison)
///     a = G0_j + sum_i a_i a_i[j] / slack_i,   slack = 1 - a[j],   s += a s_j / slack,   1/F += s_j^2 / slack,
/// a being column j of G = g^T K^-1 g and i the breaks before. Exact, so that rounding is all that is to be watched.
///
/// What is handed out is verified. The stretches c of the broken bonds B give all others, u = K0^-1 (e_plate + g_B c): s
/// is summed afresh as s0 + G0_B c, and r is what that differs by from the s that was followed. With
/// G as it is now, true stretches are s + r_e + G_eB r_B; G_ee <= 1 of a bond that is there, |G_ei|^2 <= G_ee G_ii: no
/// stretch is off by more than |r| (1 + sqrt(trace G_BB)). To |r| comes what G0's own error (IntactResponse::defect) does.
/// r of a state is the sum of what every step before it has left, times its factor: no later step makes it smaller. So the
/// last of several states, summed afresh, vouches for all of them, each with a trace of its own, which only grows.
/// A break counts where no stretch's error can let a ratio cross the limit of ties.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/criterion.hpp"
#include "crackle/equilibrium/tree/break_columns.hpp"
#include "crackle/equilibrium/tree/intact_response.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"

namespace crackle {

enum class ResponseResult : std::uint8_t {
  found,   ///< at least one break is verified
  failed,  ///< F is below the limit
  lost,    ///< a factor has to go on
};

/// A verified break, and the state that it happens in.
struct ResponseBreak {
  BondId bond = -1;
  double load = 0;       ///< at which it breaks
  double stiffness = 0;  ///< F before it
  double slack = 0;      ///< 1 - g^T K^-1 g of the bond
};

class TreeResponse {
 public:
  /// Whether following every bond takes less time than a factor does.
  [[nodiscard]] static bool is_worthwhile(const Network& network);

  /// network and kernels must outlive this.
  TreeResponse(const Network& network, IntactResponse intact, const TreeKernels& kernels, BreakOn break_on);
  TreeResponse(const TreeResponse&) = delete;
  TreeResponse& operator=(const TreeResponse&) = delete;
  ~TreeResponse() = default;

  /// G0 is the orthogonal projection that it has to be, to rounding; else this is no use.
  [[nodiscard]] bool is_sound() const;

  /// A new sample: thresholds [M], infinity for what can't break. False: it is not for this (thresholds of 0).
  [[nodiscard]] bool reset(std::span<const double> threshold);

  /// Once all that it has verified is broken: more. failed is F <= least_stiffness.
  [[nodiscard]] ResponseResult next(double least_stiffness);

  /// What the last call verified, in order: break s happens in state s.
  [[nodiscard]] std::span<const ResponseBreak> verified() const { return verified_; }

  /// One of these states; u: [n] at unit plate load, idle slots 0.
  void get_displacements(int state, std::span<double> u);

  /// After the last verified break nothing seems to hold the plate: the motion that its bond alone held, u[plate] = 1.
  /// False: no such motion is known.
  [[nodiscard]] bool get_free_motion(std::span<double> u);

 private:
  /// A state that was followed, not verified yet.
  struct Followed {
    int number = 0;      // of the bond that breaks
    double ratio = 0;    // its
    double margin = 0;   // the least error of a stretch that may decide otherwise
    double plate = 0;    // 1/F
    double trace = 0;    // of G on the broken bonds
    double carried = 0;  // norm of their stretches
    double slack = 0;
  };

  [[nodiscard]] ResponseBonds state();
  [[nodiscard]] bool choose(double largest, double least_stiffness);
  [[nodiscard]] double margin_of_equals(double largest, double tied) const;
  void compute_column(Followed& last);
  [[nodiscard]] double apply();
  void verify();
  [[nodiscard]] bool is_failed_by_last(double least_stiffness) const;
  void combine(int breaks, const double* start, std::span<double> u);

  const Network& network_;
  const TreeKernels& kernels_;
  bool magnitude_;
  IntactResponse intact_;
  BreakColumns columns_;
  AlignedVector stretch_;  // [m] of the state followed last
  AlignedVector before_;   // [m] of the last verified one
  AlignedVector per_stretch_;
  AlignedVector broken_;
  AlignedVector work_;                   // [m], [unknowns]
  std::vector<double> factor_;           // [breaks] s of the bond before it broke, over its slack
  std::vector<double> weight_;           // [breaks]
  std::vector<const double*> row_;       // [breaks]
  std::vector<const double*> response_;  // [breaks] workspace of combine
  int first_ = 0;                        // breaks before the last verified state
  double plate_ = 0;                     // 1/F
  double trace_ = 0;
  double carried_ = 0;
  bool lost_ = false;   // the last verified break is the last
  bool loose_ = false;  // because little is left after it
  std::vector<Followed> followed_;
  std::vector<ResponseBreak> verified_;
};

}  // namespace crackle
