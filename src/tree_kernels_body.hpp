/// The kernels, for one instruction set. Included by one source file per set and nowhere else.
///
/// The compiler lowers generic vectors before it clones functions, so attribute target_clones would leave the
/// clones with the base set's short vectors: hence one file per set, compiled with its own flags. Nothing
/// from the standard library is called here: its inline functions would be emitted for that set too, and the
/// linker might keep those.
#pragma once

#include "crackle/tree_kernels.hpp"

namespace crackle {

/// Isa::Vec: its vector of doubles, unaligned and free to alias the doubles it is read from.
/// Isa::Mask: a vector of as many 64-bit integers, what comparing two of them gives.
/// Isa::kRows: rows of right-hand sides that stay in registers together, two vectors each.
template <class Isa>
struct KernelBody {
  using Vec = typename Isa::Vec;
  using Mask = typename Isa::Mask;
  static constexpr int kRows = Isa::kRows;
  static constexpr int kVec = sizeof(Vec) / sizeof(double);
  static constexpr int kChunk = 2 * kVec;  // lanes held in registers at a time: kRows x 2 accumulators

  static constexpr int kAhead = 8;  // doubles in a cache line

  static const Vec& at(const double* p) { return *reinterpret_cast<const Vec*>(p); }
  static Vec& at(double* p) { return *reinterpret_cast<Vec*>(p); }

  template <int R>
  struct Tile {
    Vec sum[R][2];

    void load(const double* x) {
      for (int r = 0; r < R; ++r) {
        sum[r][0] = at(x + r * kLanes);
        sum[r][1] = at(x + r * kLanes + kVec);
      }
    }
    void store(double* x) const {
      for (int r = 0; r < R; ++r) {
        at(x + r * kLanes) = sum[r][0];
        at(x + r * kLanes + kVec) = sum[r][1];
      }
    }
    /// sum[r] -= a[r * step] * x
    void subtract(const double* a, std::ptrdiff_t step, const double* x) {
      const Vec x0 = at(x);
      const Vec x1 = at(x + kVec);
      for (int r = 0; r < R; ++r) {
        const double factor = a[r * step];
        sum[r][0] -= factor * x0;
        sum[r][1] -= factor * x1;
      }
    }
  };

  /// Pivots k .. k + R - 1 of all lanes: L is unit lower, so row k + r takes rows k + r + 1 .. of L^T.
  template <int R>
  static void backward_tile(const FrontBlock& front, int k, double* pivots, const double* x) {
    const double* column = front.entries + k * front.stride;
    for (int lane = 0; lane < kLanes; lane += kChunk) {
      Tile<R> tile;
      double* own = pivots + k * kLanes + lane;
      tile.load(own);
      const double* below = column + front.pivots;
      // Columns are used from the last to the first, and so are fronts: the next tile lies just before this
      // one.
      const double* ahead = column - R * front.stride;
      for (int i = 0; i < front.boundary; ++i, ahead += kAhead) {
        __builtin_prefetch(ahead);
        tile.subtract(below + i, front.stride, x + static_cast<std::ptrdiff_t>(front.row[i]) * kLanes + lane);
      }
      for (int i = k + R; i < front.pivots; ++i, ahead += kAhead) {
        __builtin_prefetch(ahead);
        tile.subtract(column + i, front.stride, pivots + i * kLanes + lane);
      }
      for (; ahead < column; ahead += 8) __builtin_prefetch(ahead);
      for (int i = R - 1; i > 0; --i) {
        for (int r = 0; r < i; ++r) {
          const double factor = column[k + i + r * front.stride];
          tile.sum[r][0] -= factor * tile.sum[i][0];
          tile.sum[r][1] -= factor * tile.sum[i][1];
        }
      }
      tile.store(own);
    }
  }

  static void backward(const FrontBlock& front, double* pivots, const double* x) {
    int k = front.pivots;
    for (; k >= kRows; k -= kRows) backward_tile<kRows>(front, k - kRows, pivots, x);
    if constexpr (kRows > 4) {
      for (; k >= 4; k -= 4) backward_tile<4>(front, k - 4, pivots, x);
    }
    for (; k >= 2; k -= 2) backward_tile<2>(front, k - 2, pivots, x);
    if (k == 1) backward_tile<1>(front, 0, pivots, x);
  }

  /// Asks for one more cache line of the front that comes next. About as many tiles' steps as it has lines.
  static void look_ahead(const double*& ahead, const double* end) {
    __builtin_prefetch(ahead);
    ahead += ahead < end ? kAhead : 0;
  }

  template <int R>
  static void forward_pivots(const FrontBlock& front, int k, double* pivots, const double*& ahead) {
    for (int lane = 0; lane < kLanes; lane += kChunk) {
      Tile<R> tile;
      double* own = pivots + k * kLanes + lane;
      tile.load(own);
      const double* a = front.entries + k;
      for (int i = 0; i < k; ++i, a += front.stride) {
        __builtin_prefetch(a + R);
        look_ahead(ahead, front.ahead_end);
        tile.subtract(a, 1, pivots + i * kLanes + lane);
      }
      for (int i = 0; i + 1 < R; ++i) {
        const double* column = front.entries + k + (k + i) * front.stride;
        for (int r = i + 1; r < R; ++r) {
          tile.sum[r][0] -= column[r] * tile.sum[i][0];
          tile.sum[r][1] -= column[r] * tile.sum[i][1];
        }
      }
      tile.store(own);
    }
  }

  template <int R>
  static void forward_boundary(const FrontBlock& front, int i, const double* pivots, double* x,
                               const double*& ahead) {
    for (int lane = 0; lane < kLanes; lane += kChunk) {
      Tile<R> tile;
      for (int r = 0; r < R; ++r) {
        const double* own = x + static_cast<std::ptrdiff_t>(front.row[i + r]) * kLanes + lane;
        tile.sum[r][0] = at(own);
        tile.sum[r][1] = at(own + kVec);
      }
      const double* a = front.entries + front.pivots + i;
      for (int k = 0; k < front.pivots; ++k, a += front.stride) {
        __builtin_prefetch(a + R);
        look_ahead(ahead, front.ahead_end);
        tile.subtract(a, 1, pivots + k * kLanes + lane);
      }
      for (int r = 0; r < R; ++r) {
        double* own = x + static_cast<std::ptrdiff_t>(front.row[i + r]) * kLanes + lane;
        at(own) = tile.sum[r][0];
        at(own + kVec) = tile.sum[r][1];
      }
    }
  }

  static void forward(const FrontBlock& front, double* pivots, double* x) {
    const double* ahead = front.ahead;
    int k = 0;
    for (; k + kRows <= front.pivots; k += kRows) forward_pivots<kRows>(front, k, pivots, ahead);
    for (; k + 2 <= front.pivots; k += 2) forward_pivots<2>(front, k, pivots, ahead);
    if (k < front.pivots) forward_pivots<1>(front, k, pivots, ahead);
    int i = 0;
    for (; i + kRows <= front.boundary; i += kRows) forward_boundary<kRows>(front, i, pivots, x, ahead);
    for (; i + 2 <= front.boundary; i += 2) forward_boundary<2>(front, i, pivots, x, ahead);
    if (i < front.boundary) forward_boundary<1>(front, i, pivots, x, ahead);
  }

  static void gram(const double* a, const double* b, const double* weight, int rows, double* g,
                   std::ptrdiff_t ldg) {
    for (int top = 0; top < kLanes; top += kRows) {
      for (int lane = 0; lane < kLanes; lane += kChunk) {
        Vec sum[kRows][2] = {};
        for (int k = 0; k < rows; ++k) {
          const Vec b0 = weight[k] * at(b + k * kLanes + lane);
          const Vec b1 = weight[k] * at(b + k * kLanes + lane + kVec);
          const double* left = a + k * kLanes + top;
          for (int r = 0; r < kRows; ++r) {
            sum[r][0] += left[r] * b0;
            sum[r][1] += left[r] * b1;
          }
        }
        for (int r = 0; r < kRows; ++r) {
          at(g + (top + r) * ldg + lane) += sum[r][0];
          at(g + (top + r) * ldg + lane + kVec) += sum[r][1];
        }
      }
    }
  }

  template <int R>
  static void combine_rows(const PanelPart* part, int parts, const double* weight, int k, double* out) {
    for (int lane = 0; lane < kLanes; lane += kChunk) {
      Tile<R> tile{};
      for (int p = 0; p < parts; ++p) {
        const double* y = part[p].rows + k * kLanes;
        for (int c = 0; c < kLanes; ++c)
          tile.subtract(y + c, kLanes, part[p].coefficient + c * kLanes + lane);
      }
      for (int r = 0; r < R; ++r) {
        tile.sum[r][0] *= -weight[k + r];
        tile.sum[r][1] *= -weight[k + r];
      }
      tile.store(out + k * kLanes + lane);
    }
  }

  static void combine(const PanelPart* part, int parts, const double* weight, int rows, double* out) {
    int k = 0;
    for (; k + kRows <= rows; k += kRows) combine_rows<kRows>(part, parts, weight, k, out);
    for (; k + 2 <= rows; k += 2) combine_rows<2>(part, parts, weight, k, out);
    if (k < rows) combine_rows<1>(part, parts, weight, k, out);
  }

  static void add_rows(const double* rows, std::ptrdiff_t stride, const double* weight, int count,
                       double* sum, int size) {
    constexpr int kParts = 4;
    for (int i = 0; i < size; i += kParts * kVec) {
      Vec part[kParts];
      for (int p = 0; p < kParts; ++p) part[p] = at(sum + i + p * kVec);
      for (int h = 0; h < count; ++h) {
        for (int p = 0; p < kParts; ++p) part[p] += weight[h] * at(rows + h * stride + i + p * kVec);
      }
      for (int p = 0; p < kParts; ++p) at(sum + i + p * kVec) = part[p];
    }
  }

  /// What one vector does to one column: w -= p l, then l += b w.
  struct Step {
    double p;
    double b;
  };

  template <int Columns, int Count>
  static void downdate_rows(const FrontBlock& front, double* entries, int k, double* w, const Step* step) {
    double* column = entries + k * front.stride;
    std::ptrdiff_t i = k + Columns;
    // One row at a time up to where every column and every w is on a whole vector.
    const std::ptrdiff_t aligned = (i + kVec - 1) / kVec * kVec;
    for (; i < aligned; ++i) {
      for (int c = 0; c < Columns; ++c) {
        for (int j = 0; j < Count; ++j) {
          const Step s = step[c * Count + j];
          w[i + j * front.stride] -= s.p * column[i + c * front.stride];
          column[i + c * front.stride] += s.b * w[i + j * front.stride];
        }
      }
    }
    for (; i < front.stride; i += kVec) {
      Vec l[Columns];
      Vec v[Count];
      for (int c = 0; c < Columns; ++c) l[c] = at(column + i + c * front.stride);
      for (int j = 0; j < Count; ++j) v[j] = at(w + i + j * front.stride);
      for (int c = 0; c < Columns; ++c) {
        for (int j = 0; j < Count; ++j) {
          const Step s = step[c * Count + j];
          v[j] -= s.p * l[c];
          l[c] += s.b * v[j];
        }
      }
      for (int c = 0; c < Columns; ++c) at(column + i + c * front.stride) = l[c];
      for (int j = 0; j < Count; ++j) at(w + i + j * front.stride) = v[j];
    }
  }

  /// Columns k .. k + Columns - 1, vectors 0 .. Count - 1.
  template <int Columns, int Count>
  static void downdate_panel(const FrontBlock& front, double* entries, int k, double* diagonal,
                             double* inverse, double* w, double* slack) {
    Step step[Columns * Count];
    for (int c = 0; c < Columns; ++c) {
      double* column = entries + (k + c) * front.stride + k;
      for (int j = 0; j < Count; ++j) {
        double* v = w + j * front.stride + k;
        const double p = v[c];
        const double share = p * inverse[k + c];
        if (share == 0) {
          // Nothing here yet, or a pinned pivot: its row of w is rounding.
          step[c * Count + j] = {0, 0};
          continue;
        }
        const double left = slack[j] - p * share;
        const double b = -share / left;
        diagonal[k + c] *= left / slack[j];
        inverse[k + c] *= slack[j] / left;
        slack[j] = left;
        step[c * Count + j] = {p, b};
        for (int r = c + 1; r < Columns; ++r) {
          v[r] -= p * column[r];
          column[r] += b * v[r];
        }
      }
    }
    downdate_rows<Columns, Count>(front, entries, k, w, step);
  }

  template <int Columns>
  static void downdate_columns(const FrontBlock& front, double* entries, int k, double* diagonal,
                               double* inverse, double* w, int count, double* slack) {
    int j = 0;
    for (; j + 4 <= count; j += 4) {
      downdate_panel<Columns, 4>(front, entries, k, diagonal, inverse, w + j * front.stride, slack + j);
    }
    for (; j + 2 <= count; j += 2) {
      downdate_panel<Columns, 2>(front, entries, k, diagonal, inverse, w + j * front.stride, slack + j);
    }
    if (j < count)
      downdate_panel<Columns, 1>(front, entries, k, diagonal, inverse, w + j * front.stride, slack + j);
  }

  static void downdate(const FrontBlock& front, double* entries, double* diagonal, double* inverse, double* w,
                       int count, double* slack) {
    int k = 0;
    for (; k + 8 <= front.pivots; k += 8)
      downdate_columns<8>(front, entries, k, diagonal, inverse, w, count, slack);
    for (; k + 2 <= front.pivots; k += 2)
      downdate_columns<2>(front, entries, k, diagonal, inverse, w, count, slack);
    if (k < front.pivots) downdate_columns<1>(front, entries, k, diagonal, inverse, w, count, slack);
  }

  /// Up to 64 bonds: bit e of the result tells whether bond e's force exceeds its limit in some lane.
  template <int Width, bool Magnitude>
  static unsigned long long find_some(const BondBlock& bonds, int first, int count, const double* x,
                                      const double* cut) {
    constexpr long long kNoSign = 0x7fffffffffffffffLL;
    const Position* row = bonds.row + first * Width;
    const double* value = bonds.value + first * Width;
    Mask hit{};
    unsigned long long bit = 1;
    for (int e = 0; e < count; ++e, row += Width, value += Width, bit <<= 1) {
      const Mask mark = static_cast<long long>(bit) - Mask{};
      const double limit = bonds.limit[first + e];
      for (int lane = 0; lane < kLanes; lane += kVec) {
        Vec force = value[0] * at(x + static_cast<std::ptrdiff_t>(row[0]) * kLanes + lane);
        for (int i = 1; i < Width; ++i) {
          force += value[i] * at(x + static_cast<std::ptrdiff_t>(row[i]) * kLanes + lane);
        }
        if constexpr (Magnitude) force = (Vec)((Mask)force & (kNoSign - Mask{}));
        hit |= (force > limit * at(cut + lane)) & mark;
      }
    }
    unsigned long long any = 0;
    for (int i = 0; i < kVec; ++i) any |= static_cast<unsigned long long>(hit[i]);
    return any;
  }

  template <int Width, bool Magnitude>
  static int find(const BondBlock& bonds, const double* x, const double* cut, std::int32_t* found) {
    constexpr int kBits = 64;
    int count = 0;
    for (int first = 0; first < bonds.bonds; first += kBits) {
      const int some = bonds.bonds - first < kBits ? bonds.bonds - first : kBits;
      unsigned long long hit = find_some<Width, Magnitude>(bonds, first, some, x, cut);
      for (; hit != 0; hit &= hit - 1) found[count++] = first + __builtin_ctzll(hit);
    }
    return count;
  }

  template <bool Magnitude>
  static int find_any(const BondBlock& bonds, const double* x, const double* cut, std::int32_t* found) {
    return bonds.width == 2 ? find<2, Magnitude>(bonds, x, cut, found)
                            : find<4, Magnitude>(bonds, x, cut, found);
  }

  static constexpr TreeKernels table(const char* name) {
    return {name, forward, backward, gram, combine, add_rows, downdate, find_any<true>, find_any<false>};
  }
};

}  // namespace crackle
