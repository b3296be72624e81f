#include "crackle/equilibrium/tree/break_columns.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace crackle {

namespace {

/// Entries of earlier columns from which on reading them is what a new one takes: about what a core's first cache holds.
constexpr int kEntriesOfGroup = 4096;
/// Columns that are kept for bonds that may break soon.
constexpr int kSlots = 32;

}  // namespace

BreakColumns::BreakColumns(const TreeKernels& kernels, const double* gram, int bonds, int size, int room)
    : kernels_(kernels),
      gram_(gram),
      bonds_(bonds),
      value_(static_cast<std::size_t>(size) * room),
      number_(room),
      slack_(room),
      inverse_(room),
      weight_(static_cast<std::size_t>(room) * kResponseGroup),
      ahead_(static_cast<std::size_t>(size) * kSlots),
      waiting_(kSlots),
      slot_(bonds, -1) {
  assert(size % kResponseBlock == 0 && size >= bonds);
  columns_ = {value_.data(), static_cast<std::ptrdiff_t>(room) * kResponseBlock, 0, size};
  company_.reserve(kResponseGroup);
}

void BreakColumns::clear() {
  columns_.count = 0;
  next_slot_ = 0;
  std::ranges::fill(waiting_, Waiting{});
  std::ranges::fill(slot_, -1);
}

double BreakColumns::compute(int number, const ResponseBonds& state) {
  const int at = columns_.count;
  if (slot_[number] < 0 && at * columns_.size >= kEntriesOfGroup) compute_group(number, state);
  const int slot = slot_[number];
  const int first = slot < 0 ? 0 : waiting_[slot].breaks;
  for (int h = first; h < at; ++h) weight_[h] = entry(h, number) * inverse_[h];
  kernels_.response.column(columns_, first, weight_.data(), slot < 0 ? gram(number) : waiting_column(slot));
  number_[at] = number;
  slack_[at] = 1 - entry(at, number);
  inverse_[at] = 1 / slack_[at];
  return slack_[at];
}

/// Of this bond and of those without a column that are nearest to breaking.
void BreakColumns::compute_group(int number, const ResponseBonds& state) {
  company_.assign(1, number);
  find_company(state);
  if (company_.size() < kResponseGroup) return;
  std::array<double*, kResponseGroup> sum{};
  for (int g = 0; g < kResponseGroup; ++g) {
    const int bond = company_[g];
    const int slot = next_slot_;
    next_slot_ = (next_slot_ + 1) % kSlots;
    if (waiting_[slot].number >= 0) slot_[waiting_[slot].number] = -1;
    waiting_[slot] = {bond, columns_.count};
    slot_[bond] = slot;
    sum[g] = waiting_column(slot);
    std::copy_n(gram(bond), columns_.size, sum[g]);
    for (int h = 0; h < columns_.count; ++h)
      weight_[static_cast<std::size_t>(h) * kResponseGroup + g] = entry(h, bond) * inverse_[h];
  }
  kernels_.response.group(columns_, weight_.data(), sum.data());
}

/// Fills company_ up: by the ratio, the lowest number of equals first.
void BreakColumns::find_company(const ResponseBonds& state) {
  constexpr int kOthers = kResponseGroup - 1;
  std::array<double, kOthers> ratio{};
  std::array<int, kOthers> found{};
  found.fill(-1);
  for (int e = 0; e < bonds_; ++e) {
    const double own = std::abs(state.stretch[e]) * state.per_stretch[e];
    if (!(own > ratio.back()) || slot_[e] >= 0 || e == company_.front()) continue;
    int place = kOthers - 1;
    for (; place > 0 && own > ratio[place - 1]; --place) {
      ratio[place] = ratio[place - 1];
      found[place] = found[place - 1];
    }
    ratio[place] = own;
    found[place] = e;
  }
  for (const int e : found) {
    if (e >= 0) company_.push_back(e);
  }
}

}  // namespace crackle
