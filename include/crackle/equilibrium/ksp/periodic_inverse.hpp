/// The exact inverse of an intact lattice that repeats along x: FFT along x, block tridiagonal along y.
///
/// One solve costs O(n log n). It is what "Fourier acceleration" of fracture networks approximates, in its best
/// form: the grips are in it. Source: G. G. Batrouni, A. Hansen, J. Stat. Phys. 52 (1988) 747; P. K. V. V.
/// Nukala, S. Simunovic, J. Phys. A 37 (2004) 2093 (block-circulant preconditioners).
#pragma once

#include <fftw3.h>

#include <array>
#include <complex>
#include <span>
#include <vector>

#include "crackle/network/network.hpp"

namespace crackle {

class PeriodicInverse {
 public:
  /// The network, intact, must be a generated triangular lattice and outlive this. Where stiffnesses vary along
  /// a row their mean is taken: the inverse is then that of the averaged lattice. Throws InputError for
  /// another lattice.
  explicit PeriodicInverse(const Network& network);
  ~PeriodicInverse();
  PeriodicInverse(const PeriodicInverse&) = delete;
  PeriodicInverse& operator=(const PeriodicInverse&) = delete;

  /// x = K^-1 b (size n each, idle slots as in K).
  void solve(std::span<const double> b, std::span<double> x);

 private:
  using Complex = std::complex<double>;
  /// A 2 x 2 block by rows; a fuse uses its first entry.
  using Block = std::array<Complex, 4>;

  [[nodiscard]] bool present(int row, int component, int k) const;
  [[nodiscard]] std::array<double, 3> mean_stiffness(int row) const;
  void add_row(int row, int k, std::vector<Block>& diagonal, std::vector<Block>& above) const;
  void eliminate(int k);
  void make_plans();
  void gather(std::span<const double> b);
  void sweep();
  void scatter(std::span<const double> b, std::span<double> x) const;
  [[nodiscard]] std::size_t wave(int row, int component, int k) const {
    return (static_cast<std::size_t>(row) * components_ + component) * waves_ + k;
  }

  const Network& network_;
  int components_;
  int width_ = 0;                     ///< N: nodes in a row, and rows
  int waves_ = 0;                     ///< N / 2 + 1 wave numbers
  bool slides_;                       ///< x is free in the grips, and a translation in x costs nothing
  double* field_ = nullptr;           ///< [row][component][column]
  fftw_complex* spectrum_ = nullptr;  ///< [row][component][wave number]
  fftw_plan forward_ = nullptr;
  fftw_plan backward_ = nullptr;
  std::vector<Block> inverse_;   ///< [row * waves + k] S^-1 of the Schur complement S of each row
  std::vector<Block> coupling_;  ///< [row * waves + k] S^-1 E, E the coupling to the row above
};

}  // namespace crackle
