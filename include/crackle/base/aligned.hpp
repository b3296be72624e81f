/// Vectors of numbers that start on a cache line, the large ones in large pages where the system has them.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <new>
#include <vector>

namespace crackle {

template <class T>
struct AlignedAllocator {
  using value_type = T;

  AlignedAllocator() = default;
  template <class Other>
  AlignedAllocator(const AlignedAllocator<Other>& /*other*/) {}

  /// Factor blocks are walked in an order of their own: with small pages the address translation would limit.
  static constexpr std::size_t kHugePage = std::size_t{1} << 21;
  static constexpr std::size_t kLarge =
      8 * kHugePage;  // what is smaller would waste too much of its last page
  static constexpr std::size_t kCacheLine = 64;
  static constexpr std::align_val_t alignment(std::size_t bytes) {
    return std::align_val_t{bytes >= kLarge ? kHugePage : kCacheLine};
  }

  T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    void* memory = ::operator new(bytes, alignment(bytes));
#ifdef MADV_HUGEPAGE
    if (bytes >= kLarge) madvise(memory, bytes, MADV_HUGEPAGE);  // advice only: failure changes nothing
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t count) {
    ::operator delete(memory, alignment(count * sizeof(T)));
  }
  template <class Other>
  bool operator==(const AlignedAllocator<Other>& /*other*/) const {
    return true;
  }
};

using AlignedVector = std::vector<double, AlignedAllocator<double>>;
using SingleVector = std::vector<float, AlignedAllocator<float>>;

}  // namespace crackle
