/// A user's mistake: one line that names the option or file, its value and what is allowed.
#pragma once

#include <stdexcept>
#include <string>

namespace crackle {

/// Thrown for anything the user can mend. `main` prints what() on one line and exits with status 1.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// "-lattice_size 0: allowed is an integer from 1"
  InputError(const std::string& what, const std::string& value, const std::string& allowed)
      : std::runtime_error(what + (value.empty() ? "" : " " + value) + ": allowed is " + allowed) {}
};

/// Thrown when a strategy can't go on and can't be trusted (not converged, not rigid): names the strategy,
/// the break, and what to try. Samples that were finished before are kept.
class SolverError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace crackle
