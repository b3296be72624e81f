#include "crackle/equilibrium/ksp/capacitance.hpp"

#include <cassert>
#include <cmath>
#include <numeric>

namespace crackle {

void Capacitance::clear() {
  factor_.clear();
  size_ = 0;
}

double Capacitance::grow(std::span<const double> row, double diagonal) {
  assert(std::ssize(row) == size_);
  new_row_.assign(row.begin(), row.end());
  forward(new_row_);
  const double slack = std::inner_product(
      new_row_.begin(), new_row_.end(), new_row_.begin(), diagonal,
      [](double sum, double term) { return sum - term; }, [](double a, double b) { return a * b; });
  if (!(slack > 0)) return 0;
  factor_.insert(factor_.end(), new_row_.begin(), new_row_.end());
  factor_.push_back(std::sqrt(slack));
  ++size_;
  return slack;
}

void Capacitance::forward(std::span<double> s) const {
  for (int i = 0; i < static_cast<int>(s.size()); ++i) {
    const double* const entries = row(i);
    s[i] = (s[i] - std::inner_product(entries, entries + i, s.begin(), 0.0)) / entries[i];
  }
}

void Capacitance::solve(std::span<double> s) const {
  forward(s);
  for (int i = size_ - 1; i >= 0; --i) {
    const double* const entries = row(i);
    s[i] /= entries[i];
    for (int j = 0; j < i; ++j) s[j] -= entries[j] * s[i];
  }
}

}  // namespace crackle
