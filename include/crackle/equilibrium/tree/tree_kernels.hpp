/// The inner loops of the tree strategy, in one version per instruction set, chosen at run time.
///
/// Right-hand sides come kLanes at a time, and the lanes of one unknown lie side by side: every entry of the
/// factor is used kLanes times while it is in a register, and boundary unknowns are addressed where they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "crackle/equilibrium/tree/response_kernels.hpp"
#include "crackle/equilibrium/tree/separator_tree.hpp"

namespace crackle {

inline constexpr int kLanes = 16;  ///< right-hand sides in one pass; a row is two cache lines
/// States of one pass, in groups of kLanes: a second group finds each front's block still in the cache.
inline constexpr int kMostGroups = 2;
inline constexpr int kMostStates = kMostGroups * kLanes;
/// Rows of a front that a kernel works on at once, at most: where a front may be cut.
inline constexpr int kRowsTogether = 16;

/// The numeric block of a front: unit lower triangle of p rows, then q boundary rows; zeros pad the columns.
struct FrontBlock {
  const double* entries =
      nullptr;                    ///< stride x p, column-major, on a cache line; above the diagonal: anything
  const Position* row = nullptr;  ///< [q] positions of the boundary unknowns
  std::ptrdiff_t stride = 0;
  int pivots = 0;
  int boundary = 0;
  const double* ahead = nullptr;  ///< a forward pass asks the memory for this range on its way
  const double* ahead_end = nullptr;
};

/// Bonds whose forces are looked at together: those that a front eliminates first.
struct BondBlock {
  const Position* row = nullptr;  ///< [bonds * width] positions; an unused one has value 0
  const double* value = nullptr;  ///< [bonds * width] sqrt(k) b
  const double* limit = nullptr;  ///< [bonds] threshold over sqrt(k); infinity: broken
  int bonds = 0;
  int width = 0;  ///< 2 or 4
};

/// A bond whose force is looked at in kLanes states.
struct BondForce {
  const Position* row = nullptr;  ///< [width] positions; an unused one has value 0
  const double* value = nullptr;  ///< [width] b
  double stiffness = 0;
  double threshold = 0;
  double no_force = 0;
  int width = 0;
  bool magnitude = true;  ///< of the elongation; otherwise compression is no force
};

/// Products that backward_single sums before it adds them to the whole: a sum's error grows with the longest chain.
inline constexpr int kSingleSum = 64;
/// ... and rows that it solves together: their triangle is subtracted product by product.
inline constexpr int kMostSingleRows = 24;

/// Columns of a block in single precision that lie side by side.
inline constexpr int kStrip = 8;

/// A front's block in single precision, by strips: kStrip columns (the last strip: what is left, and zeros) from the
/// strip's first diagonal entry down to `height`, row by row; strip after strip. Above the diagonal: zeros.
struct SingleBlock {
  const float* entries = nullptr;
  const Position* row = nullptr;  ///< [q] positions of the boundary unknowns
  std::ptrdiff_t height = 0;      ///< p + q, rounded up to a multiple of kStrip
  int pivots = 0;
  int boundary = 0;

  /// Where a strip starts among the entries.
  [[nodiscard]] static constexpr std::ptrdiff_t start(std::ptrdiff_t height, std::ptrdiff_t strip) {
    return kStrip * strip * height - kStrip * kStrip * (strip * (strip - 1) / 2);
  }
};

/// Bonds whose stretches, base + value . x, are looked at together in single precision.
struct SingleBonds {
  const Position* row = nullptr;  ///< [bonds * width] as in BondBlock
  const float* value = nullptr;   ///< [bonds * width] sqrt(k) b
  const float* base = nullptr;    ///< [bonds] the stretch that x = 0 stands for
  const float* limit = nullptr;   ///< [bonds] threshold over sqrt(k); infinity: broken
  int bonds = 0;
  int width = 0;  ///< 2 or 4
};

/// A bond whose ratio is looked at in 16 or 32 states in single precision.
struct SingleForce {
  const Position* row = nullptr;  ///< [width]
  const float* value = nullptr;   ///< [width] sqrt(k) b
  float base = 0;                 ///< the stretch that x = 0 stands for
  float per_limit = 0;            ///< sqrt(k) over threshold
  int width = 0;
  bool magnitude = true;
};

/// One panel's share in a linear combination of columns.
struct PanelPart {
  const double* rows = nullptr;         ///< rows x kLanes
  const std::int32_t* lane = nullptr;   ///< [columns] which of the panel's columns take part
  const double* coefficient = nullptr;  ///< columns x kLanes
  int columns = 0;
};

/// Lanes begin .. end - 1 of a row.
struct LaneRange {
  int begin = 0;
  int end = 0;

  [[nodiscard]] int size() const { return end - begin; }
};

/// What one vector of a downdate does to one column: w -= p l, then l += b w.
struct DowndateStep {
  double p;
  double b;
};

struct TreeKernels {
  const char* name;

  /// x (rows of kLanes) becomes L^-1 x over this front: pivots solved, boundary rows updated. In lanes begin ..
  /// end - 1; the others must be zero, and stay so.
  void (*forward)(const FrontBlock& front, double* pivots, double* x, int begin, int end);

  /// The same in one lane, the one that pivots and x point to. column: workspace [stride].
  void (*forward_one)(const FrontBlock& front, double* pivots, double* x, double* column);

  /// The same step by step, and to the same bits: rows first .. last - 1 of the front lose columns begin .. end - 1, which
  /// are solved, or are among these rows and come before them. Rows from `end` on are independent of each other.
  void (*forward_rows)(const FrontBlock& front, double* pivots, double* x, const LaneRange& lanes, int begin,
                       int end, int first, int last);

  /// The pivots' rows become L^-T of themselves, boundary rows of x given.
  void (*backward)(const FrontBlock& front, double* pivots, const double* x);

  /// g (lanes x kLanes, row stride ldg) += sum over `rows` rows of a^T diag(weight) b, a's first `lanes` columns.
  /// Rows of a and b are kLanes apart.
  void (*gram)(const double* a, int lanes, const double* b, const double* weight, int rows, double* g,
               std::ptrdiff_t ldg);

  /// out (rows x kLanes) = diag(weight) times the sum of y times coefficient over the parts.
  void (*combine)(const PanelPart* part, int parts, const double* weight, int rows, double* out);

  /// sum += the rows (`count` of them, `stride` apart) times their weights. Works on `size` rounded up to at most a
  /// multiple of 2 kLanes.
  void (*add_rows)(const double* rows, std::ptrdiff_t stride, const double* weight, int count, double* sum,
                   int size);

  /// product[i] = a[i] b[i] (magnitude: |a[i] b[i]|) for i < size, a multiple of kLanes. Returns the largest, 0 if none is
  /// above; NaN counts as nothing.
  double (*products)(const double* a, const double* b, int size, bool magnitude, double* product);

  /// ratio[lane] = stiffness |value . x| / threshold for one bond, 0 where neither |value . x| is above least[lane] nor
  /// the force above no_force; without magnitude: value . x.
  void (*ratios)(const BondForce& bond, const double* x, const double* least, double* ratio);

  /// L D L^T -= w w^T for each of `count` vectors w (columns of `stride` doubles over the front's p + q rows,
  /// zero-padded like the block). diagonal and inverse: [p], D and 1/D, 0 in `inverse` for a pinned pivot.
  /// On return the boundary rows of w hold what the parent has to take, and slack[i] has lost
  /// sum of w_i^2 / d over the pivots: 1 - w^T K^-1 w once the root is through.
  /// Source: P. Gill, G. Golub, W. Murray, M. Saunders, Math. Comp. 28 (1974) 505, method C1.
  /// entries: those of the front, to be written.
  void (*downdate)(const FrontBlock& front, double* entries, double* diagonal, double* inverse, double* w,
                   int count, double* slack);

  /// The same in two halves, and to the same bits. First columns begin .. end - 1 on the rows before `stop`; into `step`
  /// [(end - begin) * count] what the rows from there on have to go through. begin, end, stop: multiples of
  /// kRowsTogether, or the front's pivots (end) and stride (stop), and stop >= end.
  void (*downdate_columns)(const FrontBlock& front, double* entries, double* diagonal, double* inverse,
                           double* w, int count, double* slack, int begin, int end, int stop,
                           DowndateStep* step);
  /// Then rows first .. last - 1 of these columns and of w, each on its own: multiples of kRowsTogether, or the stride.
  void (*downdate_rows)(const FrontBlock& front, double* entries, double* w, int count, int begin, int end,
                        int first, int last, const DowndateStep* step);

  /// `backward` with one right-hand side: pivots and x are rows of one number each. On the way, unless `single` is
  /// nullptr, the block goes there in single precision (see SingleBlock), and to sum[p], for each column, what is below
  /// the diagonal, added up without signs. column: workspace [stride].
  void (*settle)(const FrontBlock& front, double* pivots, const double* x, double* column, float* single,
                 double* sum);

  /// `combine`, rounded to single precision once summed. Rows of out are `lanes` apart.
  void (*combine_single)(const PanelPart* part, int parts, const double* weight, int rows, float* out,
                         int lanes);

  /// `backward` in single precision with 16 or 32 lanes, of which begin .. end - 1 (multiples of kLanes) are solved for, to
  /// the same bits whether together or not. most[lane] becomes |pivots' row| where that is larger.
  void (*backward_single)(const SingleBlock& front, float* pivots, const float* x, int lanes, int begin,
                          int end, float* most);

  /// ratio[lane] = |base + value . x| per_limit (tension: what is above 0), and whether ratio + margin per_limit reaches
  /// `least` in any of 16 or 32 lanes; what is not a number does.
  bool (*ratios_single)(const SingleForce& bond, const float* x, int lanes, const float* margin,
                        const float* least, double* ratio);

  /// Numbers of the bonds with |base + value . x| + margin > limit * cut in any of 16 or 32 lanes (tension: without
  /// the magnitude). Returns how many. cut: [lanes] > 0; margin: [lanes] >= 0.
  int (*find_single_magnitude)(const SingleBonds& bonds, const float* x, int lanes, const float* cut,
                               const float* margin, std::int32_t* found);
  int (*find_single_tension)(const SingleBonds& bonds, const float* x, int lanes, const float* cut,
                             const float* margin, std::int32_t* found);

  /// Numbers of the bonds with |value . x| > limit * cut in any lane (tension: value . x > ...). Returns how
  /// many. cut: [kLanes] > 0.
  int (*find_magnitude)(const BondBlock& bonds, const double* x, const double* cut, std::int32_t* found);
  int (*find_tension)(const BondBlock& bonds, const double* x, const double* cut, std::int32_t* found);

  ResponseKernels response;
};

/// The versions that this processor runs, the fastest first. They sum in different orders:
/// forces differ in their last bits.
[[nodiscard]] std::span<const TreeKernels* const> tree_kernels();

}  // namespace crackle
