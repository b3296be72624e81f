#include <immintrin.h>

#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(32), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(32)));
  typedef float Single __attribute__((vector_size(32), aligned(4), may_alias));
  typedef int SingleMask __attribute__((vector_size(32)));
  static constexpr int kMostRows = 6;
  static constexpr int kRows = 4;
  template <int V>
  static constexpr int kSingleRows = V == 1 ? 8 : 4;
  template <int V>
  static constexpr int kSingleMostRows = V == 1 ? 8 : 4;

  static bool reaches(Vec a, Vec b) {
    return _mm256_movemask_pd(_mm256_cmp_pd((__m256d)a, (__m256d)b, _CMP_GE_OQ)) != 0;
  }
  static bool above(Vec a, Vec b) {
    return _mm256_movemask_pd(_mm256_cmp_pd((__m256d)a, (__m256d)b, _CMP_GT_OQ)) != 0;
  }
  static bool above(Single a, Single b) {
    return _mm256_movemask_ps(_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_GT_OQ)) != 0;
  }
  static bool all_below(Single a, Single b) {
    return _mm256_movemask_ps(_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LT_OQ)) == 0xff;
  }
};

}  // namespace

extern const TreeKernels kTreeKernels_avx2;
const TreeKernels kTreeKernels_avx2 = KernelBody<Isa>::table("avx2");

}  // namespace crackle
