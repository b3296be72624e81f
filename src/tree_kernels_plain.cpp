#include "tree_kernels_body.hpp"

namespace crackle {

namespace {

struct Isa {
  typedef double Vec __attribute__((vector_size(16), aligned(8), may_alias));
  typedef long long Mask __attribute__((vector_size(16)));
  static constexpr int kRows = 4;
};

}  // namespace

extern const TreeKernels kTreeKernels_plain;
const TreeKernels kTreeKernels_plain = KernelBody<Isa>::table("plain");

}  // namespace crackle
