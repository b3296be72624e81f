/// Leaks of our own, told from those of MPI, under AddressSanitizer; nothing without it.
#pragma once

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

namespace crackle::test {

/// What is allocated from now on doesn't count: MPI_Init drops some memory.
inline void ignore_leaks() {
#ifdef __SANITIZE_ADDRESS__
  __lsan_disable();
#endif
}

/// From now on it counts.
inline void note_leaks() {
#ifdef __SANITIZE_ADDRESS__
  __lsan_enable();
#endif
}

/// Looks for leaks now, and no more at the end; exits when there are any. Called while MPI runs: what it
/// holds is then still in its hands; later it is not, and the code that allocated it is unloaded and has no
/// name.
inline void check_leaks() {
#ifdef __SANITIZE_ADDRESS__
  __lsan_do_leak_check();
#endif
}

}  // namespace crackle::test
