#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(16), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(16)));
  static constexpr int kMostRows = 6;
  static constexpr int kRows = 4;

  static bool above(Vec a, Vec b) {
    const Mask mask = a > b;
    return (mask[0] | mask[1]) != 0;
  }
};

}  // namespace

extern const TreeKernels kTreeKernels_plain;
const TreeKernels kTreeKernels_plain = KernelBody<Isa>::table("plain");

}  // namespace crackle
