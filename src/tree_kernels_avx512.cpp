#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(64), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(64)));
  static constexpr int kRows = 8;
};

}  // namespace

extern const TreeKernels kTreeKernels_avx512;
const TreeKernels kTreeKernels_avx512 = KernelBody<Isa>::table("avx512");

}  // namespace crackle
