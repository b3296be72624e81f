/// Forward solves of a front that several threads share, for one instruction set: see tree_kernels_body.hpp.
#pragma once

#include "tree_kernels_solve.hpp"

namespace crackle {

template <class Isa>
struct SharedBody : SolveBody<Isa> {
  using Base = SolveBody<Isa>;
  using Base::kChunk;
  using Base::kRows;
  using Base::kVec;

  /// Rows i .. i + R - 1, all pivots or all below them, lose columns begin .. end - 1; of columns in their own square,
  /// those that come before them.
  template <int R, int V>
  static void forward_tile(const FrontBlock& front, double* pivots, double* x, const LaneRange& lanes,
                           int begin, int end, int i) {
    const auto own = [&](int r, int lane) {
      const int row = i + r;
      if (row < front.pivots) return pivots + row * kLanes + lane;
      return x + static_cast<std::ptrdiff_t>(front.row[row - front.pivots]) * kLanes + lane;
    };
    const int before = end < i ? end : i;
    for (int lane = lanes.begin; lane < lanes.end; lane += V * kVec) {
      typename Base::template Tile<R, V> tile;
      for (int r = 0; r < R; ++r) tile.load_row(r, own(r, lane));
      const double* a = front.entries + begin * front.stride + i;
      for (int k = begin; k < before; ++k, a += front.stride) {
        __builtin_prefetch(a + R);
        tile.subtract(a, 1, pivots + k * kLanes + lane);
      }
      for (int c = 0; c + 1 < R && i + c < end; ++c) {
        const double* column = front.entries + i + (i + c) * front.stride;
        for (int r = c + 1; r < R; ++r) {
          for (int v = 0; v < V; ++v) tile.sum[r][v] -= column[r] * tile.sum[c][v];
        }
      }
      for (int r = 0; r < R; ++r) tile.store_row(r, own(r, lane));
    }
  }

  template <int V>
  static void forward_tiles(const FrontBlock& front, double* pivots, double* x, const LaneRange& lanes,
                            int begin, int end, int first, int last) {
    int i = first;
    for (const int bound : {last < front.pivots ? last : front.pivots, last}) {
      for (; i + kRows <= bound; i += kRows) forward_tile<kRows, V>(front, pivots, x, lanes, begin, end, i);
      for (; i + 2 <= bound; i += 2) forward_tile<2, V>(front, pivots, x, lanes, begin, end, i);
      if (i < bound) forward_tile<1, V>(front, pivots, x, lanes, begin, end, i++);
    }
  }

  static void forward_rows(const FrontBlock& front, double* pivots, double* x, const LaneRange& lanes,
                           int begin, int end, int first, int last) {
    LaneRange whole{lanes.begin / kVec * kVec, lanes.end};
    if (whole.end - whole.begin <= kVec) {
      forward_tiles<1>(front, pivots, x, whole, begin, end, first, last);
    } else {
      whole.begin = whole.begin / kChunk * kChunk;
      forward_tiles<2>(front, pivots, x, whole, begin, end, first, last);
    }
  }
};

}  // namespace crackle
