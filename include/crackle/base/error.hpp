/// A user's mistake: one line that names the option or file, its value and what is allowed.
#pragma once

#include <cstddef>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

namespace crackle {

/// A text as one line of a terminal: control characters and bytes that are no UTF-8 as \n, \x1b, ...; of more than `most`
/// bytes the first ones, and how many there are in all.
[[nodiscard]] std::string one_line(const std::string& text, std::size_t most = 1000);

/// Bytes of a value that a message shows.
inline constexpr std::size_t kShownValue = 200;

/// Thrown for anything the user can mend. `main` prints what() on one line and exits with status 1.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// "-lattice_size 0: allowed is an integer from 1"
  InputError(const std::string& what, const std::string& value, const std::string& allowed)
      : std::runtime_error(what + (value.empty() ? "" : " " + one_line(value, kShownValue)) +
                           ": allowed is " + allowed) {}
};

/// "2702 MiB"
[[nodiscard]] std::string mebibytes(double bytes);

/// What to try where memory doesn't suffice.
inline constexpr const char* kLessMemory =
    "try fewer processes, or a solver that keeps no factor (-ksp_type cg -pc_type circulant, or jacobi)";

/// What to tell of any exception: of std::bad_alloc how much memory is in use, and what the limit is.
[[nodiscard]] std::string explain(const std::exception& error);

/// Throws std::bad_alloc when there is no memory of that size: before a library asks for it that doesn't survive a no.
void expect_memory(std::size_t bytes);

/// make(), where std::bad_alloc becomes an InputError that says what the memory was wanted for ("a lattice of L = 8192").
template <class Make>
auto with_memory_for(const std::string& what, Make make) {
  try {
    return make();
  } catch (const std::bad_alloc& error) {
    throw InputError("no memory for " + what + ": " + explain(error));
  }
}

/// Thrown when a strategy can't go on and can't be trusted (not converged, not rigid): names the strategy,
/// the break, and what to try. Samples that were finished before are kept.
class SolverError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace crackle
