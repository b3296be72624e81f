/// Columns of the Gram matrix G = g^T K^-1 g, each of a bond that broke, as it was just before.
///
/// The next one is G0's own and what all earlier ones add, which reading them limits: where they are many, bonds that may
/// break soon get theirs in the same pass, and later only what has been added since.
#pragma once

#include <vector>

#include "crackle/base/aligned.hpp"
#include "crackle/equilibrium/tree/tree_kernels.hpp"

namespace crackle {

class BreakColumns {
 public:
  /// gram: G0, rows of `size` (whole blocks), one for each of the bonds; it and kernels must outlive this. room: breaks.
  BreakColumns(const TreeKernels& kernels, const double* gram, int bonds, int size, int room);
  BreakColumns(const BreakColumns&) = delete;
  BreakColumns& operator=(const BreakColumns&) = delete;
  ~BreakColumns() = default;

  /// A new sample.
  void clear();

  [[nodiscard]] int count() const { return columns_.count; }
  [[nodiscard]] bool full() const { return columns_.count + 1 >= static_cast<int>(number_.size()); }

  /// Column number count() becomes that of this bond. state: of all bonds now, whose ratios tell who may break soon.
  /// Returns the bond's slack 1 - g^T K^-1 g.
  double compute(int number, const ResponseBonds& state);
  /// That bond has broken.
  void keep() { ++columns_.count; }

  /// The bond of break h, up to count() after compute, and its slack.
  [[nodiscard]] int number(int h) const { return number_[h]; }
  [[nodiscard]] double slack(int h) const { return slack_[h]; }
  /// What its column has for a bond.
  [[nodiscard]] double entry(int h, int number) const {
    return value_[static_cast<std::size_t>(number / kResponseBlock) * columns_.stride +
                  static_cast<std::size_t>(h) * kResponseBlock + number % kResponseBlock];
  }
  /// As kernels want them.
  [[nodiscard]] const ResponseColumns& get() const { return columns_; }

 private:
  /// A column of a bond that has not broken, up to some break.
  struct Waiting {
    int number = -1;
    int breaks = 0;
  };

  void compute_group(int number, const ResponseBonds& state);
  void find_company(const ResponseBonds& state);
  [[nodiscard]] double* waiting_column(int slot) {
    return ahead_.data() + static_cast<std::size_t>(slot) * columns_.size;
  }
  [[nodiscard]] const double* gram(int number) const {
    return gram_ + static_cast<std::size_t>(number) * columns_.size;
  }

  const TreeKernels& kernels_;
  const double* gram_;
  int bonds_;
  AlignedVector value_;
  ResponseColumns columns_;
  std::vector<int> number_;       // [breaks]
  std::vector<double> slack_;     // [breaks]
  std::vector<double> inverse_;   // [breaks] 1 / slack
  std::vector<double> weight_;    // [breaks * kResponseGroup]
  AlignedVector ahead_;           // [slots][m] columns of bonds that may break soon
  std::vector<Waiting> waiting_;  // [slots]
  std::vector<int> slot_;         // [bonds] -1: none
  int next_slot_ = 0;             // the oldest
  std::vector<int> company_;      // those of a group, found last
};

}  // namespace crackle
