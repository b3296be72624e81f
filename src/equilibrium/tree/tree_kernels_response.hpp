/// The loops of response_kernels.hpp, for one instruction set: see tree_kernels_body.hpp.
#pragma once

#include "crackle/equilibrium/tree/response_kernels.hpp"
#include "tree_kernels_solve.hpp"

namespace crackle {

template <class Isa>
struct ResponseBody {
  using Base = SolveBody<Isa>;
  using Vec = typename Base::Vec;
  using Mask = typename Base::Mask;
  static constexpr int kVec = Base::kVec;
  static constexpr int kParts = 8;  // vectors that are summed together: enough to hide the latency of a sum
  static constexpr int kSpan = kParts * kVec;
  static_assert(kResponseBlock % kSpan == 0);

  static Vec& at(double* p) { return Base::at(p); }
  static const Vec& at(const double* p) { return Base::at(p); }

  static Vec magnitude_of(Vec v) {
    constexpr long long kNoSign = 0x7fffffffffffffffLL;
    return (Vec)((Mask)v & (kNoSign - Mask{}));
  }

  static double sum_of(Vec v) {
    double sum = 0;
    for (int i = 0; i < kVec; ++i) sum += v[i];
    return sum;
  }

  /// One span of a column: start and what the earlier ones, a block's width apart, add.
  static void add_columns(const double* columns, const double* weight, int count, const double* start,
                          double* own) {
    Vec part[kParts];
    for (int p = 0; p < kParts; ++p) part[p] = at(start + p * kVec);
    for (int h = 0; h < count; ++h) {
      for (int p = 0; p < kParts; ++p) part[p] += weight[h] * at(columns + h * kResponseBlock + p * kVec);
    }
    for (int p = 0; p < kParts; ++p) at(own + p * kVec) = part[p];
  }

  static void column(const ResponseColumns& columns, int first, const double* weight, const double* start) {
    const std::ptrdiff_t own = static_cast<std::ptrdiff_t>(columns.count) * kResponseBlock;
    const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(first) * kResponseBlock;
    double* block = columns.value;
    for (int i = 0; i < columns.size; i += kResponseBlock, block += columns.stride) {
      for (int j = 0; j < kResponseBlock; j += kSpan)
        add_columns(block + from + j, weight + first, columns.count - first, start + i + j, block + own + j);
    }
  }

  static void group(const ResponseColumns& columns, const double* weight, double* const* sum) {
    constexpr int kWide = kVec == 8 ? 4 : 2;  // with kResponseGroup sums what registers hold
    const double* block = columns.value;
    for (int i = 0; i < columns.size; i += kResponseBlock, block += columns.stride) {
      for (int j = 0; j < kResponseBlock; j += kWide * kVec) {
        Vec part[kResponseGroup][kWide];
        for (int g = 0; g < kResponseGroup; ++g) {
          for (int p = 0; p < kWide; ++p) part[g][p] = at(sum[g] + i + j + p * kVec);
        }
        for (int h = 0; h < columns.count; ++h) {
          Vec earlier[kWide];
          for (int p = 0; p < kWide; ++p) earlier[p] = at(block + h * kResponseBlock + j + p * kVec);
          for (int g = 0; g < kResponseGroup; ++g) {
            for (int p = 0; p < kWide; ++p) part[g][p] += weight[h * kResponseGroup + g] * earlier[p];
          }
        }
        for (int g = 0; g < kResponseGroup; ++g) {
          for (int p = 0; p < kWide; ++p) at(sum[g] + i + j + p * kVec) = part[g][p];
        }
      }
    }
  }

  template <bool Magnitude>
  static ResponseChange apply_any(const ResponseColumns& columns, double factor, const ResponseBonds& bonds) {
    const double* own = columns.value + static_cast<std::ptrdiff_t>(columns.count) * kResponseBlock;
    Vec most{};
    Vec square{};
    Vec carried{};
    for (int i = 0; i < columns.size; i += kResponseBlock, own += columns.stride) {
      for (int j = 0; j < kResponseBlock; j += kVec) {
        const Vec a = at(own + j);
        const Vec broken = at(bonds.broken + i + j);
        square += broken * a * a;
        const Vec s = at(bonds.stretch + i + j) + factor * a;
        at(bonds.stretch + i + j) = s;
        carried += broken * s * s;
        const Vec ratio = (Magnitude ? magnitude_of(s) : s) * at(bonds.per_stretch + i + j);
        most = ratio > most ? ratio : most;
      }
    }
    ResponseChange change{0, sum_of(square), sum_of(carried)};
    for (int i = 0; i < kVec; ++i) change.largest = most[i] > change.largest ? most[i] : change.largest;
    return change;
  }

  static ResponseChange apply(const ResponseColumns& columns, double factor, const ResponseBonds& bonds,
                              bool magnitude) {
    return magnitude ? apply_any<true>(columns, factor, bonds) : apply_any<false>(columns, factor, bonds);
  }

  template <bool Magnitude>
  static Vec ratio_at(const ResponseBonds& bonds, int i) {
    const Vec s = at(bonds.stretch + i);
    return (Magnitude ? magnitude_of(s) : s) * at(bonds.per_stretch + i);
  }

  /// The lowest number from i on whose ratio is `least` or more.
  template <bool Magnitude>
  static int find_ratio(const ResponseBonds& bonds, int i, int size, double least) {
    while (i < size && !Isa::reaches(ratio_at<Magnitude>(bonds, i), least - Vec{})) i += kVec;
    for (; i < size; ++i) {
      const double s = bonds.stretch[i];
      if ((Magnitude && s < 0 ? -s : s) * bonds.per_stretch[i] >= least) return i;
    }
    return -1;
  }

  /// Quotients are compared by products: gap / room < least.gap / least.room. No room: infinite, which a product tells
  /// without an exception of arithmetic (-fp_trap).
  struct Margin {
    Vec gap = 1 - Vec{};
    Vec room{};

    void take(Vec other_gap, Vec other_room) {
      const auto less = other_gap * room < gap * other_room;
      gap = less ? other_gap : gap;
      room = less ? other_room : room;
    }
  };

  template <bool Magnitude>
  static ResponseChoice choose_any(const ResponseBonds& bonds, int size, double largest, double tied) {
    ResponseChoice choice;
    choice.first = find_ratio<Magnitude>(bonds, 0, size, tied);
    choice.top = find_ratio<Magnitude>(bonds, choice.first / kVec * kVec, size, largest);
    if (choice.top < 0) return choice;
    const Vec per_top = bonds.per_stretch[choice.top] - Vec{};
    Margin least[2];
    Mask equal{};
    for (int i = 0; i < size; i += 2 * kVec) {
      for (int j = 0; j < 2; ++j) {
        const Vec ratio = ratio_at<Magnitude>(bonds, i + j * kVec);
        const Mask is_top = ratio == largest - Vec{};
        equal -= is_top;
        least[j].take(is_top ? 1 - Vec{} : magnitude_of(ratio - tied),
                      is_top ? Vec{} : per_top + at(bonds.per_stretch + i + j * kVec));
      }
    }
    least[0].take(least[1].gap, least[1].room);
    for (int i = 0; i < kVec; ++i) {
      if (least[0].room[i] > 0) {
        const double margin = least[0].gap[i] / least[0].room[i];
        choice.margin = margin < choice.margin ? margin : choice.margin;
      }
      choice.equal += static_cast<int>(equal[i]);
    }
    return choice;
  }

  static ResponseChoice choose(const ResponseBonds& bonds, int size, double largest, double tied,
                               bool magnitude) {
    return magnitude ? choose_any<true>(bonds, size, largest, tied)
                     : choose_any<false>(bonds, size, largest, tied);
  }

  static double recompute(const double* const* row, const double* weight, int count, const double* start,
                          double* sum, int size) {
    Vec square{};
    for (int i = 0; i < size; i += kSpan) {
      Vec part[kParts];
      for (int p = 0; p < kParts; ++p) part[p] = at(start + i + p * kVec);
      for (int h = 0; h < count; ++h) {
        for (int p = 0; p < kParts; ++p) part[p] += weight[h] * at(row[h] + i + p * kVec);
      }
      for (int p = 0; p < kParts; ++p) {
        const Vec change = part[p] - at(sum + i + p * kVec);
        square += change * change;
        at(sum + i + p * kVec) = part[p];
      }
    }
    return sum_of(square);
  }

  static constexpr ResponseKernels table() { return {column, group, apply, choose, recompute}; }
};

}  // namespace crackle
