#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(32), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(32)));
  static constexpr int kRows = 4;
};

}  // namespace

extern const TreeKernels kTreeKernels_avx2;
const TreeKernels kTreeKernels_avx2 = KernelBody<Isa>::table("avx2");

}  // namespace crackle
