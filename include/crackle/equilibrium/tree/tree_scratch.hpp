/// Memory that a downdate and a forward pass work in, one after the other: zero whenever nobody has it.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>

#include "crackle/base/aligned.hpp"

namespace crackle {

class TreeScratch {
 public:
  explicit TreeScratch(std::size_t size) : value_(size) {}

  /// All of it, for the length of this life, by the end of which it is zero again.
  class Loan {
   public:
    explicit Loan(TreeScratch& owner) : owner_(owner) {
      assert(!owner.lent_);
      assert(owner.is_zero());
      owner.lent_ = true;
    }
    ~Loan() {
      assert(owner_.is_zero());
      owner_.lent_ = false;
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;

    [[nodiscard]] double* data() const { return owner_.value_.data(); }

   private:
    TreeScratch& owner_;
  };

  [[nodiscard]] bool is_zero() const {
    return std::ranges::all_of(value_, [](double x) { return x == 0; });
  }

 private:
  AlignedVector value_;
  bool lent_ = false;
};

}  // namespace crackle
