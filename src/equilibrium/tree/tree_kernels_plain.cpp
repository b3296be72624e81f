#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(16), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(16)));
  typedef float Single __attribute__((vector_size(16), aligned(4), may_alias));
  typedef int SingleMask __attribute__((vector_size(16)));
  static constexpr int kMostRows = 6;
  static constexpr int kRows = 4;
  template <int V>
  static constexpr int kSingleRows = V == 1 ? 8 : 4;
  template <int V>
  static constexpr int kSingleMostRows = V == 1 ? 8 : 4;

  static bool reaches(Vec a, Vec b) {
    const Mask mask = a >= b;
    return (mask[0] | mask[1]) != 0;
  }
  static bool above(Vec a, Vec b) {
    const Mask mask = a > b;
    return (mask[0] | mask[1]) != 0;
  }
  static bool above(Single a, Single b) {
    const SingleMask mask = a > b;
    return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
  }
  static bool all_below(Single a, Single b) {
    const SingleMask mask = a < b;
    return (mask[0] & mask[1] & mask[2] & mask[3]) != 0;
  }
};

}  // namespace

extern const TreeKernels kTreeKernels_plain;
const TreeKernels kTreeKernels_plain = KernelBody<Isa>::table("plain");

}  // namespace crackle
