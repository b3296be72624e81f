#include <immintrin.h>

#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(32), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(32)));
  static constexpr int kMostRows = 6;
  static constexpr int kRows = 4;

  static bool above(Vec a, Vec b) {
    return _mm256_movemask_pd(_mm256_cmp_pd((__m256d)a, (__m256d)b, _CMP_GT_OQ)) != 0;
  }
};

}  // namespace

extern const TreeKernels kTreeKernels_avx2;
const TreeKernels kTreeKernels_avx2 = KernelBody<Isa>::table("avx2");

}  // namespace crackle
