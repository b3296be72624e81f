#include <immintrin.h>

#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(64), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(64)));
  typedef float Single __attribute__((vector_size(64), aligned(4), may_alias));
  typedef int SingleMask __attribute__((vector_size(64)));
  static constexpr int kMostRows = 12;
  static constexpr int kRows = 8;
  template <int V>
  static constexpr int kSingleRows = V == 1 ? 16 : 8;
  template <int V>
  static constexpr int kSingleMostRows = V == 1 ? 24 : 8;

  static bool reaches(Vec a, Vec b) { return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_GE_OQ) != 0; }
  static bool above(Vec a, Vec b) { return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_GT_OQ) != 0; }
  static bool above(Single a, Single b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GT_OQ) != 0; }
  static bool all_below(Single a, Single b) {
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ) == 0xffff;
  }
};

}  // namespace

extern const TreeKernels kTreeKernels_avx512;
const TreeKernels kTreeKernels_avx512 = KernelBody<Isa>::table("avx512");

}  // namespace crackle
