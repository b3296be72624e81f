/// Triangular solves with kLanes right-hand sides, for one instruction set: see tree_kernels_body.hpp.
#pragma once

#include "crackle/equilibrium/tree/tree_kernels.hpp"

namespace crackle {

/// Isa::Vec: its vector of doubles, unaligned and free to alias the doubles it is read from.
/// Isa::Mask: a vector of as many 64-bit integers, what comparing two of them gives.
/// Isa::above(a, b), Isa::reaches(a, b): a > b, a >= b anywhere.
/// Isa::kRows: rows of right-hand sides that stay in registers together, two vectors each; kMostRows: where that
/// makes an end.
template <class Isa>
struct SolveBody {
  using Vec = typename Isa::Vec;
  using Mask = typename Isa::Mask;
  static constexpr int kRows = Isa::kRows;
  static constexpr int kMostRows = Isa::kMostRows;
  static constexpr int kVec = sizeof(Vec) / sizeof(double);
  static constexpr int kChunk = 2 * kVec;  // lanes held in registers at a time: kRows x 2 accumulators

  static constexpr int kAhead = 8;  // doubles in a cache line

  static const Vec& at(const double* p) { return *reinterpret_cast<const Vec*>(p); }
  static Vec& at(double* p) { return *reinterpret_cast<Vec*>(p); }

  /// R rows of V vectors each, in registers.
  template <int R, int V = 2>
  struct Tile {
    Vec sum[R][V];

    void load_row(int r, const double* x) {
      for (int v = 0; v < V; ++v) sum[r][v] = at(x + v * kVec);
    }
    void store_row(int r, double* x) const {
      for (int v = 0; v < V; ++v) at(x + v * kVec) = sum[r][v];
    }
    void load(const double* x) {
      for (int r = 0; r < R; ++r) load_row(r, x + r * kLanes);
    }
    void store(double* x) const {
      for (int r = 0; r < R; ++r) store_row(r, x + r * kLanes);
    }
    /// sum[r] -= a[r * step] * x
    void subtract(const double* a, std::ptrdiff_t step, const double* x) {
      Vec row[V];
      for (int v = 0; v < V; ++v) row[v] = at(x + v * kVec);
      for (int r = 0; r < R; ++r) {
        const double factor = a[r * step];
        for (int v = 0; v < V; ++v) sum[r][v] -= factor * row[v];
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

  template <int R>
  struct Rows {
    static constexpr int value = R;
  };

  /// act(Rows<rows>{}) for rows in 1 .. Most: a tile of exactly that many.
  template <int Most, class Act>
  static void with_rows(int rows, Act act) {
    if constexpr (Most > 1) {
      if (rows < Most) return with_rows<Most - 1>(rows, act);
    }
    act(Rows<Most>{});
  }

  static void backward(const FrontBlock& front, double* pivots, const double* x) {
    for (int k = front.pivots; k > 0;) {
      const int rows = k <= kMostRows ? k : kRows;
      k -= rows;
      with_rows<kMostRows>(rows, [&](auto r) { backward_tile<decltype(r)::value>(front, k, pivots, x); });
    }
  }

  /// Asks for one more cache line of the front that comes next. About as many tiles' steps as it has lines.
  static void look_ahead(const double*& ahead, const double* end) {
    __builtin_prefetch(ahead);
    ahead += ahead < end ? kAhead : 0;
  }

  template <int R, int V>
  static void forward_pivots(const FrontBlock& front, int k, double* pivots, int begin, int end,
                             const double*& ahead) {
    for (int lane = begin; lane < end; lane += V * kVec) {
      Tile<R, V> tile;
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
          for (int v = 0; v < V; ++v) tile.sum[r][v] -= column[r] * tile.sum[i][v];
        }
      }
      tile.store(own);
    }
  }

  template <int R, int V>
  static void forward_boundary(const FrontBlock& front, int i, const double* pivots, double* x, int begin,
                               int end, const double*& ahead) {
    for (int lane = begin; lane < end; lane += V * kVec) {
      Tile<R, V> tile;
      const auto own = [&](int r) {
        return x + static_cast<std::ptrdiff_t>(front.row[i + r]) * kLanes + lane;
      };
      for (int r = 0; r < R; ++r) tile.load_row(r, own(r));
      const double* a = front.entries + front.pivots + i;
      for (int k = 0; k < front.pivots; ++k, a += front.stride) {
        __builtin_prefetch(a + R);
        look_ahead(ahead, front.ahead_end);
        tile.subtract(a, 1, pivots + k * kLanes + lane);
      }
      for (int r = 0; r < R; ++r) tile.store_row(r, own(r));
    }
  }

  template <int V>
  static void forward_lanes(const FrontBlock& front, double* pivots, double* x, int begin, int end) {
    const double* ahead = front.ahead;
    int k = 0;
    for (; k + kRows <= front.pivots; k += kRows)
      forward_pivots<kRows, V>(front, k, pivots, begin, end, ahead);
    for (; k + 2 <= front.pivots; k += 2) forward_pivots<2, V>(front, k, pivots, begin, end, ahead);
    if (k < front.pivots) forward_pivots<1, V>(front, k, pivots, begin, end, ahead);
    int i = 0;
    for (; i + kRows <= front.boundary; i += kRows)
      forward_boundary<kRows, V>(front, i, pivots, x, begin, end, ahead);
    for (; i + 2 <= front.boundary; i += 2) forward_boundary<2, V>(front, i, pivots, x, begin, end, ahead);
    if (i < front.boundary) forward_boundary<1, V>(front, i, pivots, x, begin, end, ahead);
  }

  /// Whole vectors, and two of them together where that many lanes are asked for.
  static void forward(const FrontBlock& front, double* pivots, double* x, int begin, int end) {
    begin = begin / kVec * kVec;
    if (end - begin <= kVec) {
      forward_lanes<1>(front, pivots, x, begin, end);
    } else {
      forward_lanes<2>(front, pivots, x, begin / kChunk * kChunk, end);
    }
  }

  /// Columns k .. k + Columns - 1 of the block applied to one right-hand side.
  template <int Columns>
  static void forward_columns(const FrontBlock& front, int k, double* x) {
    const double* column = front.entries + k * front.stride;
    double own[Columns];
    for (int c = 0; c < Columns; ++c) {
      own[c] = x[k + c];
      for (int i = 0; i < c; ++i) own[c] -= column[k + c + i * front.stride] * own[i];
      x[k + c] = own[c];
    }
    std::ptrdiff_t i = k + Columns;
    const std::ptrdiff_t aligned = (i + kVec - 1) / kVec * kVec;
    for (; i < aligned; ++i) {
      for (int c = 0; c < Columns; ++c) x[i] -= column[i + c * front.stride] * own[c];
    }
    for (; i < front.stride; i += kVec) {
      Vec sum = at(x + i);
      for (int c = 0; c < Columns; ++c) sum -= own[c] * at(column + i + c * front.stride);
      at(x + i) = sum;
    }
  }

  static void forward_one(const FrontBlock& front, double* pivots, double* x, double* column) {
    const int height = front.pivots + front.boundary;
    for (int k = 0; k < front.pivots; ++k) column[k] = pivots[k * kLanes];
    for (int i = 0; i < front.boundary; ++i)
      column[front.pivots + i] = x[static_cast<std::ptrdiff_t>(front.row[i]) * kLanes];
    for (int i = height; i < front.stride; ++i) column[i] = 0;
    int k = 0;
    for (; k + 8 <= front.pivots; k += 8) forward_columns<8>(front, k, column);
    for (; k + 2 <= front.pivots; k += 2) forward_columns<2>(front, k, column);
    if (k < front.pivots) forward_columns<1>(front, k, column);
    for (int i = 0; i < front.pivots; ++i) pivots[i * kLanes] = column[i];
    for (int i = 0; i < front.boundary; ++i)
      x[static_cast<std::ptrdiff_t>(front.row[i]) * kLanes] = column[front.pivots + i];
  }

  /// Rows k .. k + R - 1 of the parts' sum, weighted.
  template <int R>
  static void combine_tile(const PanelPart* part, int parts, const double* weight, int k, int lane,
                           Tile<R>& tile) {
    tile = {};
    for (int p = 0; p < parts; ++p) {
      const double* y = part[p].rows + k * kLanes;
      for (int c = 0; c < part[p].columns; ++c)
        tile.subtract(y + part[p].lane[c], kLanes, part[p].coefficient + c * kLanes + lane);
    }
    for (int r = 0; r < R; ++r) {
      tile.sum[r][0] *= -weight[k + r];
      tile.sum[r][1] *= -weight[k + r];
    }
  }

  template <int R>
  static void combine_rows(const PanelPart* part, int parts, const double* weight, int k, double* out,
                           int /*lanes*/) {
    Tile<R> tile;
    for (int lane = 0; lane < kLanes; lane += kChunk) {
      combine_tile<R>(part, parts, weight, k, lane, tile);
      tile.store(out + k * kLanes + lane);
    }
  }

  template <int R>
  static void combine_rows(const PanelPart* part, int parts, const double* weight, int k, float* out,
                           int lanes) {
    typedef float Half __attribute__((vector_size(sizeof(Vec) / 2), aligned(4), may_alias));
    Tile<R> tile;
    for (int lane = 0; lane < kLanes; lane += kChunk) {
      combine_tile<R>(part, parts, weight, k, lane, tile);
      for (int r = 0; r < R; ++r) {
        for (int v = 0; v < 2; ++v) {
          *reinterpret_cast<Half*>(out + (k + r) * lanes + lane + v * kVec) =
              __builtin_convertvector(tile.sum[r][v], Half);
        }
      }
    }
  }

  template <class Real>
  static void combine_all(const PanelPart* part, int parts, const double* weight, int rows, Real* out,
                          int lanes) {
    int k = 0;
    for (; k + kRows <= rows; k += kRows) combine_rows<kRows>(part, parts, weight, k, out, lanes);
    for (; k + 2 <= rows; k += 2) combine_rows<2>(part, parts, weight, k, out, lanes);
    if (k < rows) combine_rows<1>(part, parts, weight, k, out, lanes);
  }

  static void combine(const PanelPart* part, int parts, const double* weight, int rows, double* out) {
    combine_all(part, parts, weight, rows, out, kLanes);
  }

  static void combine_single(const PanelPart* part, int parts, const double* weight, int rows, float* out,
                             int lanes) {
    combine_all(part, parts, weight, rows, out, lanes);
  }
};

}  // namespace crackle
