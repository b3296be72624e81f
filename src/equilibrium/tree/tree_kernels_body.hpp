/// The kernels, for one instruction set. Included by one source file per set and nowhere else.
///
/// The compiler lowers generic vectors before it clones functions, so attribute target_clones would leave the
/// clones with the base set's short vectors: hence one file per set, compiled with its own flags. Nothing
/// from the standard library is called here: its inline functions would be emitted for that set too, and the
/// linker might keep those.
#pragma once

#include "tree_kernels_response.hpp"
#include "tree_kernels_shared.hpp"
#include "tree_kernels_single.hpp"

namespace crackle {

template <class Isa>
struct KernelBody : SharedBody<Isa> {
  using Base = SharedBody<Isa>;
  using Narrow = SingleBody<Isa>;
  using Base::at;
  using Base::kChunk;
  using Base::kRows;
  using Base::kVec;
  using typename Base::Mask;
  using typename Base::Vec;

  template <int R>
  static void gram_rows(const double* a, const double* b, const double* weight, int rows, double* g,
                        std::ptrdiff_t ldg) {
    for (int lane = 0; lane < kLanes; lane += kChunk) {
      Vec sum[R][2] = {};
      for (int k = 0; k < rows; ++k) {
        const Vec b0 = weight[k] * at(b + k * kLanes + lane);
        const Vec b1 = weight[k] * at(b + k * kLanes + lane + kVec);
        for (int r = 0; r < R; ++r) {
          sum[r][0] += a[k * kLanes + r] * b0;
          sum[r][1] += a[k * kLanes + r] * b1;
        }
      }
      for (int r = 0; r < R; ++r) {
        at(g + r * ldg + lane) += sum[r][0];
        at(g + r * ldg + lane + kVec) += sum[r][1];
      }
    }
  }

  static void gram(const double* a, int lanes, const double* b, const double* weight, int rows, double* g,
                   std::ptrdiff_t ldg) {
    int top = 0;
    for (; top + kRows <= lanes; top += kRows) gram_rows<kRows>(a + top, b, weight, rows, g + top * ldg, ldg);
    for (; top + 2 <= lanes; top += 2) gram_rows<2>(a + top, b, weight, rows, g + top * ldg, ldg);
    if (top < lanes) gram_rows<1>(a + top, b, weight, rows, g + top * ldg, ldg);
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

  static Vec magnitude_of(Vec v) {
    constexpr long long kNoSign = 0x7fffffffffffffffLL;
    return (Vec)((Mask)v & (kNoSign - Mask{}));
  }

  static double products(const double* a, const double* b, int size, bool magnitude, double* product) {
    Vec most{};
    for (int i = 0; i < size; i += kVec) {
      Vec p = at(a + i) * at(b + i);
      if (magnitude) p = magnitude_of(p);
      at(product + i) = p;
      most = p > most ? p : most;
    }
    double largest = 0;
    for (int i = 0; i < kVec; ++i) largest = most[i] > largest ? most[i] : largest;
    return largest;
  }

  static void ratios(const BondForce& bond, const double* x, const double* least, double* ratio) {
    for (int lane = 0; lane < kLanes; lane += kVec) {
      Vec size{};
      for (int i = 0; i < bond.width; ++i)
        size += bond.value[i] * at(x + static_cast<std::ptrdiff_t>(bond.row[i]) * kLanes + lane);
      if (bond.magnitude) size = magnitude_of(size);
      const Vec force = bond.stiffness * size;
      const auto carries = (size > at(least + lane)) | (force > bond.no_force);
      at(ratio + lane) = carries ? force / bond.threshold : Vec{};
    }
  }

  /// Rows first .. last - 1 of columns k .. k + Columns - 1, and of Count vectors.
  template <int Columns, int Count>
  static void downdate_tile(const FrontBlock& front, double* entries, int k, double* w, std::ptrdiff_t first,
                            std::ptrdiff_t last, const DowndateStep* step) {
    double* column = entries + k * front.stride;
    std::ptrdiff_t i = first;
    // One row at a time up to where every column and every w is on a whole vector.
    const std::ptrdiff_t aligned = (i + kVec - 1) / kVec * kVec;
    for (; i < aligned; ++i) {
      for (int c = 0; c < Columns; ++c) {
        for (int j = 0; j < Count; ++j) {
          const DowndateStep s = step[c * Count + j];
          w[i + j * front.stride] -= s.p * column[i + c * front.stride];
          column[i + c * front.stride] += s.b * w[i + j * front.stride];
        }
      }
    }
    for (; i < last; i += kVec) {
      Vec l[Columns];
      Vec v[Count];
      for (int c = 0; c < Columns; ++c) l[c] = at(column + i + c * front.stride);
      for (int j = 0; j < Count; ++j) v[j] = at(w + i + j * front.stride);
      for (int c = 0; c < Columns; ++c) {
        for (int j = 0; j < Count; ++j) {
          const DowndateStep s = step[c * Count + j];
          v[j] -= s.p * l[c];
          l[c] += s.b * v[j];
        }
      }
      for (int c = 0; c < Columns; ++c) at(column + i + c * front.stride) = l[c];
      for (int j = 0; j < Count; ++j) at(w + i + j * front.stride) = v[j];
    }
  }

  /// What Count vectors do to columns k .. k + Columns - 1, in the triangle of these rows.
  template <int Columns, int Count>
  static void downdate_triangle(const FrontBlock& front, double* entries, int k, double* diagonal,
                                double* inverse, double* w, double* slack, DowndateStep* step) {
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
  }

  /// act(Size<columns>, Size<vectors>, first column, first vector) in the order in which a downdate goes: a few columns at a
  /// time take all vectors, a few at a time.
  template <int N>
  struct Size {
    static constexpr int value = N;
  };
  template <int Columns, class Act>
  static void for_each_vector(int k, int count, Act act) {
    int j = 0;
    for (; j + 4 <= count; j += 4) act(Size<Columns>{}, Size<4>{}, k, j);
    for (; j + 2 <= count; j += 2) act(Size<Columns>{}, Size<2>{}, k, j);
    if (j < count) act(Size<Columns>{}, Size<1>{}, k, j);
  }
  template <class Act>
  static void for_each_tile(int begin, int end, int count, Act act) {
    int k = begin;
    for (; k + 8 <= end; k += 8) for_each_vector<8>(k, count, act);
    for (; k + 2 <= end; k += 2) for_each_vector<2>(k, count, act);
    if (k < end) for_each_vector<1>(k, count, act);
  }

  static void downdate(const FrontBlock& front, double* entries, double* diagonal, double* inverse, double* w,
                       int count, double* slack) {
    for_each_tile(0, front.pivots, count, [&](auto columns, auto vectors, int k, int j) {
      constexpr int kColumns = decltype(columns)::value;
      constexpr int kCount = decltype(vectors)::value;
      DowndateStep step[kColumns * kCount];
      double* own = w + j * front.stride;
      downdate_triangle<kColumns, kCount>(front, entries, k, diagonal, inverse, own, slack + j, step);
      downdate_tile<kColumns, kCount>(front, entries, k, own, k + kColumns, front.stride, step);
    });
  }

  static void downdate_columns(const FrontBlock& front, double* entries, double* diagonal, double* inverse,
                               double* w, int count, double* slack, int begin, int end, int stop,
                               DowndateStep* step) {
    for_each_tile(begin, end, count, [&](auto columns, auto vectors, int k, int j) {
      constexpr int kColumns = decltype(columns)::value;
      constexpr int kCount = decltype(vectors)::value;
      double* own = w + j * front.stride;
      downdate_triangle<kColumns, kCount>(front, entries, k, diagonal, inverse, own, slack + j, step);
      downdate_tile<kColumns, kCount>(front, entries, k, own, k + kColumns, stop, step);
      step += kColumns * kCount;
    });
  }

  static void downdate_rows(const FrontBlock& front, double* entries, double* w, int count, int begin,
                            int end, int first, int last, const DowndateStep* step) {
    for_each_tile(begin, end, count, [&](auto columns, auto vectors, int k, int j) {
      constexpr int kColumns = decltype(columns)::value;
      constexpr int kCount = decltype(vectors)::value;
      downdate_tile<kColumns, kCount>(front, entries, k, w + j * front.stride, first, last, step);
      step += kColumns * kCount;
    });
  }

  template <int Width, bool Magnitude>
  static int find(const BondBlock& bonds, const double* x, const double* cut, std::int32_t* found) {
    const Position* row = bonds.row;
    const double* value = bonds.value;
    int count = 0;
    for (int e = 0; e < bonds.bonds; ++e, row += Width, value += Width) {
      const double limit = bonds.limit[e];
      bool above = false;
      for (int lane = 0; lane < kLanes; lane += kVec) {
        Vec force = value[0] * at(x + static_cast<std::ptrdiff_t>(row[0]) * kLanes + lane);
        for (int i = 1; i < Width; ++i) {
          force += value[i] * at(x + static_cast<std::ptrdiff_t>(row[i]) * kLanes + lane);
        }
        if constexpr (Magnitude) force = magnitude_of(force);
        above |= Isa::above(force, limit * at(cut + lane));
      }
      found[count] = e;
      count += above ? 1 : 0;
    }
    return count;
  }

  template <bool Magnitude>
  static int find_any(const BondBlock& bonds, const double* x, const double* cut, std::int32_t* found) {
    return bonds.width == 2 ? find<2, Magnitude>(bonds, x, cut, found)
                            : find<4, Magnitude>(bonds, x, cut, found);
  }

  static constexpr TreeKernels table(const char* name) {
    return {.name = name,
            .forward = Base::forward,
            .forward_one = Base::forward_one,
            .forward_rows = Base::forward_rows,
            .backward = Base::backward,
            .gram = gram,
            .combine = Base::combine,
            .add_rows = add_rows,
            .products = products,
            .ratios = ratios,
            .downdate = downdate,
            .downdate_columns = downdate_columns,
            .downdate_rows = downdate_rows,
            .settle = Narrow::settle,
            .combine_single = Base::combine_single,
            .backward_single = Narrow::backward_single,
            .ratios_single = Narrow::ratios_single,
            .find_single_magnitude = Narrow::template find_single<true>,
            .find_single_tension = Narrow::template find_single<false>,
            .find_magnitude = find_any<true>,
            .find_tension = find_any<false>,
            .response = ResponseBody<Isa>::table()};
  }
};

}  // namespace crackle
