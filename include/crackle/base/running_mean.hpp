/// Mean and standard error of numbers that come one by one, or in parts from elsewhere.
///
/// Source: T. F. Chan, G. H. Golub, R. J. LeVeque, Am. Stat. 37 (1983) 242.
#pragma once

#include <cmath>
#include <cstdint>

namespace crackle {

class RunningMean {
 public:
  void add(double value) {
    ++count_;
    const double step = value - mean_;
    mean_ += step / static_cast<double>(count_);
    squares_ += step * (value - mean_);
  }

  void add(const RunningMean& other) {
    if (other.count_ == 0) return;
    const auto a = static_cast<double>(count_);
    const auto b = static_cast<double>(other.count_);
    const double step = other.mean_ - mean_;
    mean_ += step * b / (a + b);
    squares_ += other.squares_ + step * step * a * b / (a + b);
    count_ += other.count_;
  }

  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] double mean() const { return mean_; }
  /// Standard error of the mean; 0 for fewer than two values.
  [[nodiscard]] double error() const {
    const auto n = static_cast<double>(count_);
    return count_ < 2 ? 0 : std::sqrt(squares_ / (n - 1) / n);
  }

 private:
  std::int64_t count_ = 0;
  double mean_ = 0;
  double squares_ = 0;  // sum of squared distances from the mean
};

}  // namespace crackle
