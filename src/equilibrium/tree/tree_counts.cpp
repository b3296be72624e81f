/// What the tree strategy says of itself.

#include <array>
#include <cstdio>

#include "crackle/equilibrium/tree/equilibrium_tree.hpp"

namespace crackle {

std::string describe(const TreeCounts& counts) {
  const auto per = [](std::int64_t a, std::int64_t b) {
    return b > 0 ? static_cast<double>(a) / static_cast<double>(b) : 0.0;
  };
  const auto line = [](const char* format, auto... values) {
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(), format, values...);
    return std::string(text.data());
  };
  const BatchCounts& batch = counts.batch;
  const auto breaks = batch.verified;
  return line("tree: %lld fronts, %lld factor entries, %s kernels\n", static_cast<long long>(counts.fronts),
              static_cast<long long>(counts.factor_entries), counts.kernels) +
         line("  by responses %lld breaks; a factor went on in %lld samples\n",
              static_cast<long long>(counts.responded), static_cast<long long>(counts.left)) +
         line("  passes %lld, of which repeated %lld; breaks a pass %.2f of %.2f predicted\n",
              static_cast<long long>(batch.passes), static_cast<long long>(batch.repeated),
              per(breaks, batch.passes), per(batch.predicted, batch.passes)) +
         line("  a pass: %.1f new columns, %.1f candidates\n", per(batch.columns, batch.passes),
              per(batch.candidates, batch.passes)) +
         line("  a break: %.1f fronts visited, %.0f entries read, %.0f updated\n", per(batch.fronts, breaks),
              per(batch.entries, breaks), per(counts.entries_downdated, breaks)) +
         line(
             "  in single precision %lld passes, of which undecided %lld; contenders %lld; error %.2g of its "
             "bound\n",
             static_cast<long long>(batch.single), static_cast<long long>(batch.undecided),
             static_cast<long long>(batch.contenders), batch.used_margin) +
         line("  downdates %lld, refactors %lld, checked %lld, differences %lld\n",
              static_cast<long long>(counts.downdates), static_cast<long long>(counts.refactors),
              static_cast<long long>(counts.checked), static_cast<long long>(counts.differences));
}

}  // namespace crackle
