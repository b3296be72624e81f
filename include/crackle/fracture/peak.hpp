/// The rule of the peak: the largest load of a sample, and of equal ones the first.
#pragma once

#include <cstdint>

namespace crackle {

/// Whether a break at `load` makes a new peak. n_p: number of the break that made the last one, 0: there is none yet;
/// peak_load: its load.
[[nodiscard]] constexpr bool is_new_peak(double load, double peak_load, std::int64_t n_p) {
  return n_p == 0 || load > peak_load;
}

}  // namespace crackle
