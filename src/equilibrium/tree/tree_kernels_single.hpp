/// Kernels in single precision, and what leads to them, for one instruction set: see tree_kernels_body.hpp.
#pragma once

#include "crackle/equilibrium/tree/tree_kernels.hpp"

namespace crackle {

/// Isa::Single: its vector of floats, unaligned and free to alias; Isa::SingleMask: of as many 32-bit integers.
/// Isa::kSingleRows<V>, kSingleMostRows<V>: rows of right-hand sides of V vectors each that stay in registers together,
/// and where that makes an end.
template <class Isa>
struct SingleBody {
  using Single = typename Isa::Single;
  using SingleMask = typename Isa::SingleMask;
  static constexpr int kSingle = sizeof(Single) / sizeof(float);

  static const Single& at(const float* p) { return *reinterpret_cast<const Single*>(p); }
  static Single& at(float* p) { return *reinterpret_cast<Single*>(p); }

  static Single magnitude_of(Single v) {
    constexpr int kNoSign = 0x7fffffff;
    return (Single)((SingleMask)v & (kNoSign - SingleMask{}));
  }

  template <int R, int V, int Lanes>
  static void add(const float* own, Single (&sum)[R][V]) {
#pragma GCC unroll 32
    for (int r = 0; r < R; ++r) {
      for (int v = 0; v < V; ++v) sum[r][v] += at(own + r * Lanes + v * kSingle);
    }
  }

  /// What has been summed goes to its rows; another part of the sum begins.
  template <int R, int V, int Lanes>
  static void put_away(float* own, Single (&sum)[R][V]) {
#pragma GCC unroll 32
    for (int r = 0; r < R; ++r) {
      for (int v = 0; v < V; ++v) {
        at(own + r * Lanes + v * kSingle) += sum[r][v];
        sum[r][v] = Single{};
      }
    }
  }

  /// Unrolled to the last: sums that are addressed by a variable would leave their registers.
  template <int R, int V>
  static void solve_triangle(const float* const* strip, int k, Single (&sum)[R][V]) {
#pragma GCC unroll 32
    for (int back = 1; back < R; ++back) {
      const int i = R - back;
#pragma GCC unroll 32
      for (int r = 0; r < i; ++r) {
        const float factor = strip[r / kStrip][(k + i) * kStrip + r % kStrip];
        for (int v = 0; v < V; ++v) sum[r][v] -= factor * sum[i][v];
      }
    }
  }

  /// strip[s]: where row 0 would be of the strip s after that of pivot k, from that pivot on.
  template <int Strips>
  static void find_strips(const SingleBlock& front, int k, const float* (&strip)[Strips]) {
    for (int s = 0; s < Strips; ++s) {
      const std::ptrdiff_t number = k / kStrip + s;
      strip[s] =
          front.entries + SingleBlock::start(front.height, number) - number * kStrip * kStrip + k % kStrip;
    }
  }

  /// One row of right-hand sides, times its entries in R columns.
  template <int R, int V, int Strips>
  static void subtract_row(const float* const (&strip)[Strips], std::ptrdiff_t entry, const float* from,
                           Single (&sum)[R][V]) {
    Single row[V];
    for (int v = 0; v < V; ++v) row[v] = at(from + v * kSingle);
#pragma GCC unroll 32
    for (int r = 0; r < R; ++r) {
      const float factor = strip[r / kStrip][entry + r % kStrip];
      for (int v = 0; v < V; ++v) sum[r][v] -= factor * row[v];
    }
  }

  /// What was solved takes its place, and is counted in `most`.
  template <int R, int V, int Lanes>
  static void finish(const Single (&sum)[R][V], float* own, float* most) {
    for (int v = 0; v < V; ++v) {
      Single largest = at(most + v * kSingle);
#pragma GCC unroll 32
      for (int r = 0; r < R; ++r) {
        at(own + r * Lanes + v * kSingle) = sum[r][v];
        const Single size = magnitude_of(sum[r][v]);
        largest = (size > largest) | (size != size) ? size : largest;  // not a number stays
      }
      at(most + v * kSingle) = largest;
    }
  }

  /// Pivots k .. k + R - 1 in V vectors of lanes from `lane` on. k + R is where a strip ends, or the pivots do, or it is
  /// within one strip.
  template <int R, int V, int Lanes>
  static void backward_tile(const SingleBlock& front, int k, float* pivots, const float* x, int lane,
                            float* most) {
    constexpr int kStrips = (R + kStrip - 1) / kStrip;
    const float* strip[kStrips];
    find_strips(front, k, strip);
    float* own = pivots + k * Lanes + lane;
    Single sum[R][V] = {};
    const auto subtract = [&](std::ptrdiff_t entry, const float* from) {
      subtract_row<R, V>(strip, entry, from, sum);
    };
    // The next tile, and the next front, lie just before this one.
    const float* ahead = strip[0] + k * kStrip - (front.height - k) * (R > kStrip ? 2 * kStrip : kStrip);
    std::ptrdiff_t entry = static_cast<std::ptrdiff_t>(front.pivots) * kStrip;
    const Position* at_row = front.row;
    const Position* const last = front.row + front.boundary;
    while (at_row < last) {
      const Position* const end = last - at_row > kSingleSum ? at_row + kSingleSum : last;
      for (; at_row < end; ++at_row) {
        __builtin_prefetch(ahead);
        subtract(entry, x + static_cast<std::ptrdiff_t>(*at_row) * Lanes + lane);
        entry += kStrip;
        ahead += kStrip * kStrips;
      }
      if (at_row < last) put_away<R, V, Lanes>(own, sum);
    }
    entry = static_cast<std::ptrdiff_t>(k + R) * kStrip;
    for (int i = k + R; i < front.pivots;) {
      if (front.boundary > 0 || i > k + R) put_away<R, V, Lanes>(own, sum);
      const int end = front.pivots - i > kSingleSum ? i + kSingleSum : front.pivots;
      for (; i < end; ++i, entry += kStrip) subtract(entry, pivots + i * Lanes + lane);
    }
    add<R, V, Lanes>(own, sum);
    solve_triangle<R, V>(strip, k, sum);
    finish<R, V, Lanes>(sum, own, most + lane);
  }

  /// Tiles of exactly `rows` rows in 1 .. Most, lanes begin .. end - 1.
  template <int Most, int V, int Lanes>
  static void backward_rows(int rows, const SingleBlock& front, int k, float* pivots, const float* x,
                            int begin, int end, float* most) {
    if constexpr (Most > 1) {
      if (rows < Most) return backward_rows<Most - 1, V, Lanes>(rows, front, k, pivots, x, begin, end, most);
    }
    for (int lane = begin; lane < end; lane += V * kSingle)
      backward_tile<Most, V, Lanes>(front, k, pivots, x, lane, most);
  }

  /// Tiles are the same whatever part of the lanes is solved for: V vectors of it at a time.
  template <int V, int Lanes>
  static void backward_lanes(const SingleBlock& front, float* pivots, const float* x, int begin, int end,
                             float* most) {
    constexpr int kVectors = Lanes / kSingle < 2 ? 1 : 2;
    constexpr int kRows = Isa::template kSingleRows<kVectors>;
    constexpr int kMost = Isa::template kSingleMostRows<kVectors>;
    static_assert(kMost <= kMostSingleRows);
    for (int k = front.pivots; k > 0;) {
      // down to where whole tiles are left
      const int rows = k <= kMost ? k : (k % kRows == 0 ? kRows : k % kRows);
      k -= rows;
      backward_rows<kMost, V, Lanes>(rows, front, k, pivots, x, begin, end, most);
    }
  }

  static void backward_single(const SingleBlock& front, float* pivots, const float* x, int lanes, int begin,
                              int end, float* most) {
    constexpr int kInGroup = kLanes / kSingle < 2 ? 1 : 2;  // vectors
    if (lanes == kLanes) {
      backward_lanes<kInGroup, kLanes>(front, pivots, x, begin, end, most);
    } else if (end - begin == lanes) {
      backward_lanes<2, 2 * kLanes>(front, pivots, x, begin, end, most);
    } else {
      backward_lanes<kInGroup, 2 * kLanes>(front, pivots, x, begin, end, most);
    }
  }

  template <int Width, bool Magnitude, int Lanes>
  static int find_lanes(const SingleBonds& bonds, const float* x, const float* cut, const float* margin,
                        std::int32_t* found) {
    const Position* row = bonds.row;
    const float* value = bonds.value;
    int count = 0;
    for (int e = 0; e < bonds.bonds; ++e, row += Width, value += Width) {
      bool above = false;
      for (int lane = 0; lane < Lanes; lane += kSingle) {
        Single stretch =
            bonds.base[e] + value[0] * at(x + static_cast<std::ptrdiff_t>(row[0]) * Lanes + lane);
        for (int i = 1; i < Width; ++i)
          stretch += value[i] * at(x + static_cast<std::ptrdiff_t>(row[i]) * Lanes + lane);
        if constexpr (Magnitude) stretch = magnitude_of(stretch);
        above |= Isa::above(stretch, bonds.limit[e] * at(cut + lane) - at(margin + lane));
      }
      found[count] = e;
      count += above ? 1 : 0;
    }
    return count;
  }

  template <bool Magnitude>
  static int find_single(const SingleBonds& bonds, const float* x, int lanes, const float* cut,
                         const float* margin, std::int32_t* found) {
    constexpr int kTwice = 2 * kLanes;
    if (bonds.width == 2) {
      return lanes == kLanes ? find_lanes<2, Magnitude, kLanes>(bonds, x, cut, margin, found)
                             : find_lanes<2, Magnitude, kTwice>(bonds, x, cut, margin, found);
    }
    return lanes == kLanes ? find_lanes<4, Magnitude, kLanes>(bonds, x, cut, margin, found)
                           : find_lanes<4, Magnitude, kTwice>(bonds, x, cut, margin, found);
  }

  static bool ratios_single(const SingleForce& bond, const float* x, int lanes, const float* margin,
                            const float* least, double* ratio) {
    typedef double Wide __attribute__((vector_size(2 * sizeof(Single)), aligned(8), may_alias));
    bool reaches = false;
    for (int lane = 0; lane < lanes; lane += kSingle) {
      Single size =
          bond.base + bond.value[0] * at(x + static_cast<std::ptrdiff_t>(bond.row[0]) * lanes + lane);
      for (int i = 1; i < bond.width; ++i)
        size += bond.value[i] * at(x + static_cast<std::ptrdiff_t>(bond.row[i]) * lanes + lane);
      if (bond.magnitude) {
        size = magnitude_of(size);
      } else {
        size = size < Single{} ? Single{} : size;
      }
      const Single found = bond.per_limit * size;
      *reinterpret_cast<Wide*>(ratio + lane) = __builtin_convertvector(found, Wide);
      reaches |= !Isa::all_below(found + bond.per_limit * at(margin + lane), at(least + lane));
    }
    return reaches;
  }

  typedef double Quad __attribute__((vector_size(32), aligned(8), may_alias));
  typedef float SingleQuad __attribute__((vector_size(16), aligned(4), may_alias));

  /// v becomes its transpose.
  static void transpose(Quad* v) {
    const Quad a = __builtin_shufflevector(v[0], v[1], 0, 4, 2, 6);
    const Quad b = __builtin_shufflevector(v[0], v[1], 1, 5, 3, 7);
    const Quad c = __builtin_shufflevector(v[2], v[3], 0, 4, 2, 6);
    const Quad d = __builtin_shufflevector(v[2], v[3], 1, 5, 3, 7);
    v[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
    v[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
    v[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
    v[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
  }

  /// Rows i .. i + 3 of four columns (`columns` of them there, the others zeros), row by row.
  template <bool Full>
  static void load_rows(const double* from, std::ptrdiff_t stride, int columns, Quad* v) {
#pragma GCC unroll 4
    for (int c = 0; c < 4; ++c) {
      v[c] = Quad{};
      if (Full || c < columns) v[c] = *reinterpret_cast<const Quad*>(from + c * stride);
    }
    transpose(v);
  }

  /// A strip from row `begin` on: its products with `rows` and, with Store, their magnitudes summed. Two sums of each,
  /// so that one needn't wait for the other. single: of that row.
  template <bool Store, bool Full>
  static void settle_below(const FrontBlock& front, int first, int begin, const double* rows, float* single,
                           double* product, double* size) {
    const int height = (front.pivots + front.boundary + kStrip - 1) / kStrip * kStrip;
    const double* from = front.entries + static_cast<std::ptrdiff_t>(first) * front.stride;
    const int columns = front.pivots - first;
    Quad sum[2][2] = {};
    Quad magnitude[2] = {};
    for (int i = begin; i < height; i += 4, single += 4 * kStrip) {
#pragma GCC unroll 2
      for (int half = 0; half < 2; ++half) {
        Quad v[4];
        load_rows<Full>(from + 4 * half * front.stride + i, front.stride, columns - 4 * half, v);
#pragma GCC unroll 4
        for (int r = 0; r < 4; ++r) {
          sum[half][r % 2] += v[r] * rows[i + r];
          if constexpr (Store) {
            magnitude[half] += v[r] < Quad{} ? -v[r] : v[r];
            *reinterpret_cast<SingleQuad*>(single + r * kStrip + 4 * half) =
                __builtin_convertvector(v[r], SingleQuad);
          }
        }
      }
    }
    for (int c = 0; c < kStrip; ++c) {
      product[c] = sum[c / 4][0][c % 4] + sum[c / 4][1][c % 4];
      if constexpr (Store) size[c] = magnitude[c / 4][c % 4];
    }
  }

  /// The square at a strip's head, solved last: a triangle of its pivots and, in a last strip, rows of the boundary. What
  /// is above the diagonal meets only products that have been used.
  template <bool Store, bool Full>
  static void settle_square(const FrontBlock& front, int first, double* product, double* rows, float* single,
                            double* size) {
    const double* from = front.entries + static_cast<std::ptrdiff_t>(first) * front.stride + first;
    const int columns = Full ? kStrip : front.pivots - first;
    alignas(64) double square[kStrip][kStrip];
    for (int i = 0; i < kStrip; i += 4) {
      for (int half = 0; half < 2; ++half) {
        Quad v[4];
        load_rows<Full>(from + 4 * half * front.stride + i, front.stride, columns - 4 * half, v);
        for (int r = 0; r < 4; ++r) *reinterpret_cast<Quad*>(&square[i + r][4 * half]) = v[r];
      }
    }
    Quad sum[2] = {*reinterpret_cast<const Quad*>(product), *reinterpret_cast<const Quad*>(product + 4)};
#pragma GCC unroll 8
    for (int r = kStrip - 1; r >= 0; --r) {
      if (Full || r < columns) rows[first + r] -= sum[r / 4][r % 4];
      const double x = rows[first + r];
      sum[0] += x * *reinterpret_cast<const Quad*>(&square[r][0]);
      if (r > 4) sum[1] += x * *reinterpret_cast<const Quad*>(&square[r][4]);
      if constexpr (Store) {
        for (int c = 0; c < kStrip; ++c) {
          const double entry = c < r ? square[r][c] : 0;
          size[c] += entry < 0 ? -entry : entry;
          single[r * kStrip + c] = static_cast<float>(entry);
        }
      }
    }
  }

  template <bool Store, bool Full>
  static void settle_strip(const FrontBlock& front, int first, double* rows, float* single, double* size) {
    alignas(64) double product[kStrip];
    settle_below<Store, Full>(front, first, first + kStrip, rows, Store ? single + kStrip * kStrip : nullptr,
                              product, size);
    settle_square<Store, Full>(front, first, product, rows, single, size);
  }

  static void settle(const FrontBlock& front, double* pivots, const double* x, double* rows, float* single,
                     double* sum) {
    for (int i = 0; i < front.pivots; ++i) rows[i] = pivots[i];
    for (int i = 0; i < front.boundary; ++i) rows[front.pivots + i] = x[front.row[i]];
    for (std::ptrdiff_t i = front.pivots + front.boundary; i < front.stride; ++i) rows[i] = 0;
    const std::ptrdiff_t height = (front.pivots + front.boundary + kStrip - 1) / kStrip * kStrip;
    for (int strip = (front.pivots + kStrip - 1) / kStrip; strip-- > 0;) {
      const int first = strip * kStrip;
      const bool full = first + kStrip <= front.pivots;
      if (single != nullptr) {
        float* const to = single + SingleBlock::start(height, strip);
        alignas(64) double size[kStrip];
        (full ? settle_strip<true, true> : settle_strip<true, false>)(front, first, rows, to, size);
        for (int c = 0; c < kStrip && first + c < front.pivots; ++c) sum[first + c] = size[c];
      } else {
        (full ? settle_strip<false, true> : settle_strip<false, false>)(front, first, rows, nullptr, nullptr);
      }
    }
    for (int i = 0; i < front.pivots; ++i) pivots[i] = rows[i];
  }
};

}  // namespace crackle
