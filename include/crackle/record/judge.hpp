/// Complaints about what a file says of one sample.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "crackle/base/error.hpp"

namespace crackle {

/// Throws InputError, naming dataset, sample, value and what is allowed, for a demand that doesn't hold.
class Judge {
 public:
  explicit Judge(std::int64_t sample) : sample_(sample) {}

  void demand(bool holds, const std::string& what, const std::string& value,
              const std::string& allowed) const {
    if (holds) return;
    throw InputError(what + " of sample " + std::to_string(sample_), value, allowed);
  }
  void demand(bool holds, const std::string& what, double value, const std::string& allowed) const {
    if (!holds) demand(holds, what, std::to_string(value), allowed);
  }
  void demand_finite(const std::string& what, double value) const {
    demand(std::isfinite(value) && value >= 0, what, value, "a finite number from 0");
  }

 private:
  std::int64_t sample_;
};

}  // namespace crackle
