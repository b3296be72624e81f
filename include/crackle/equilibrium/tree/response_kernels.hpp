/// The inner loops of TreeResponse, in one version per instruction set; TreeKernels has them.
#pragma once

#include <cstddef>

namespace crackle {

/// Bonds whose columns lie together: what is read of a block of many columns is contiguous. [m] below are numbers of all
/// bonds, filled up to whole blocks with bonds that neither stretch nor break.
inline constexpr int kResponseBlock = 64;

/// Columns of the Gram matrix, each as it was when its bond broke.
struct ResponseColumns {
  double* value = nullptr;    ///< [m / kResponseBlock][room for columns][kResponseBlock]
  std::ptrdiff_t stride = 0;  ///< doubles from one block to the next
  int count = 0;              ///< columns that are there
  int size = 0;               ///< m
};

/// The bonds of one state.
struct ResponseBonds {
  double* stretch = nullptr;            ///< [m] g . u
  const double* per_stretch = nullptr;  ///< [m] sqrt(k) / threshold; 0: broken or can't break
  const double* broken = nullptr;       ///< [m] 1: broken; 0
};

struct ResponseChange {
  double largest = 0;  ///< ratio; NaN counts as nothing
  double column = 0;   ///< sum of squares of the column's entries at broken bonds,
  double stretch = 0;  ///< and of their stretches
};

struct ResponseChoice {
  int first = -1;  ///< lowest number of the bonds whose ratio is `tied` or more
  int top = -1;    ///< of those whose ratio is the largest
  int equal = 0;   ///< how many of these there are
  /// All other stretches may be off by this, and the top's, before a ratio crosses `tied`: the least of
  /// |ratio - tied| / (per_stretch + that of the top).
  double margin = __builtin_inf();
};

/// Columns that are summed together, each entry of the earlier ones read once for all.
inline constexpr int kResponseGroup = 4;

struct ResponseKernels {
  /// Column number `count` becomes start (size: m) and the sum of the earlier ones from number `first` on times their
  /// weights; weight[0] is that of column 0.
  void (*column)(const ResponseColumns& columns, int first, const double* weight, const double* start);

  /// The same of kResponseGroup sums of all earlier columns, weights [count][kResponseGroup]: each is added to `sum` (size
  /// of each: m).
  void (*group)(const ResponseColumns& columns, const double* weight, double* const* sum);

  /// stretch += factor times column number `count`. magnitude: a ratio is |stretch| per_stretch; else stretch per_stretch.
  ResponseChange (*apply)(const ResponseColumns& columns, double factor, const ResponseBonds& bonds,
                          bool magnitude);

  /// largest: of the ratios, as `apply` sums and multiplies; tied: > 0, not more than that.
  ResponseChoice (*choose)(const ResponseBonds& bonds, int size, double largest, double tied, bool magnitude);

  /// sum = start and the sum of the rows (of `size` each, all of whole blocks) times their weights. Returns the sum of
  /// squares of what has changed in `sum`.
  double (*recompute)(const double* const* row, const double* weight, int count, const double* start,
                      double* sum, int size);
};

}  // namespace crackle
