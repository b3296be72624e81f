#include "crackle/equilibrium/tree/tree_kernels.hpp"

#include <vector>

namespace crackle {

extern const TreeKernels kTreeKernels_plain;
#ifdef CRACKLE_X86_KERNELS
extern const TreeKernels kTreeKernels_avx512;
extern const TreeKernels kTreeKernels_avx2;
#endif

std::span<const TreeKernels* const> tree_kernels() {
  static const std::vector<const TreeKernels*> runnable = [] {
    std::vector<const TreeKernels*> found;
#ifdef CRACKLE_X86_KERNELS
    if (__builtin_cpu_supports("avx512f") != 0) found.push_back(&kTreeKernels_avx512);
    if (__builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0) {
      found.push_back(&kTreeKernels_avx2);
    }
#endif
    found.push_back(&kTreeKernels_plain);
    return found;
  }();
  return runnable;
}

}  // namespace crackle
