#include "crackle/equilibrium/ksp/periodic_inverse.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "crackle/base/error.hpp"
#include "crackle/network/lattices.hpp"

namespace crackle {

namespace {

/// Nodes in a row of the triangular lattice that the network is; throws when it is none.
int find_width(const Lattice& lattice) {
  const auto width = static_cast<int>(std::lround(std::sqrt(lattice.nodes())));
  const auto same = [](Vector2 a, Vector2 b) { return a.x == b.x && a.y == b.y; };
  if (width >= 2 && width * width == lattice.nodes() && lattice.position[width].y > 0) {
    const Lattice whole = triangular_lattice(width - 1, lattice.position[width].y);
    if (whole.bond == lattice.bond && whole.grip == lattice.grip && whole.period_x == lattice.period_x &&
        std::ranges::equal(whole.position, lattice.position, same)) {
      return width;
    }
  }
  throw InputError("-pc_type", "circulant on this network", "another type, or -lattice triangular");
}

template <class Block>
Block multiply(const Block& a, const Block& b) {
  return {a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2],
          a[2] * b[1] + a[3] * b[3]};
}

template <class Block>
Block adjoint(const Block& a) {
  return {std::conj(a[0]), std::conj(a[2]), std::conj(a[1]), std::conj(a[3])};
}

template <class Block>
Block invert(const Block& a) {
  const auto determinant = a[0] * a[3] - a[1] * a[2];
  return {a[3] / determinant, -a[1] / determinant, -a[2] / determinant, a[0] / determinant};
}

}  // namespace

PeriodicInverse::PeriodicInverse(const Network& network)
    : network_(network),
      components_(network.components),
      width_(find_width(network.lattice)),
      waves_(width_ / 2 + 1),
      slides_(network.model == Model::spring && network.grips == Grips::sliding),
      inverse_(static_cast<std::size_t>(width_) * waves_),
      coupling_(inverse_.size()) {
  for (int k = 0; k < waves_; ++k) eliminate(k);
  make_plans();
}

PeriodicInverse::~PeriodicInverse() {
  fftw_destroy_plan(forward_);
  fftw_destroy_plan(backward_);
  fftw_free(field_);
  fftw_free(spectrum_);
}

/// A plan that is estimated, not measured: the same arithmetic in every run.
void PeriodicInverse::make_plans() {
  const int transforms = width_ * components_;
  field_ = fftw_alloc_real(static_cast<std::size_t>(transforms) * width_);
  spectrum_ = fftw_alloc_complex(static_cast<std::size_t>(transforms) * waves_);
  if (field_ == nullptr || spectrum_ == nullptr) throw std::runtime_error("FFTW found no memory");
  forward_ = fftw_plan_many_dft_r2c(1, &width_, transforms, field_, nullptr, 1, width_, spectrum_, nullptr, 1,
                                    waves_, FFTW_ESTIMATE);
  backward_ = fftw_plan_many_dft_c2r(1, &width_, transforms, spectrum_, nullptr, 1, waves_, field_, nullptr,
                                     1, width_, FFTW_ESTIMATE);
}

/// Whether a row has an unknown there. The plate is the top row's along the load, at k = 0 alone. A translation
/// in x costs nothing: at k = 0 the bottom row's x is held, and `scatter` moves the lattice back to its pin.
bool PeriodicInverse::present(int row, int component, int k) const {
  const bool grip = row == 0 || row == width_ - 1;
  if (component >= components_) return false;
  if (!grip) return true;
  if (component == components_ - 1) return row > 0 && k == 0;
  return slides_ && !(row == 0 && k == 0);
}

/// Of the horizontal bonds of a row, and of those up to the right and to the left.
std::array<double, 3> PeriodicInverse::mean_stiffness(int row) const {
  std::array<double, 3> sum{};
  const int kinds = row == width_ - 1 ? 1 : 3;
  const int first = 3 * row * width_;
  for (int i = 0; i < kinds * width_; ++i) sum[i % kinds] += network_.stiffness[first + i];
  for (double& value : sum) value /= width_;
  return sum;
}

/// The bonds that start in a row: to the diagonal blocks of it and the row above, and to their coupling.
void PeriodicInverse::add_row(int row, int k, std::vector<Block>& diagonal, std::vector<Block>& above) const {
  const auto stiffness = mean_stiffness(row);
  const double angle = 2 * std::numbers::pi * k / width_;
  const int shift = row % 2;
  for (int kind = 0; kind < (row == width_ - 1 ? 1 : 3); ++kind) {
    const Vector2 d = network_.lattice.direction[3 * row * width_ + kind];
    const bool fuse = components_ == 1;
    const std::array<double, 4> dd = fuse ? std::array<double, 4>{1, 0, 0, 0}
                                          : std::array<double, 4>{d.x * d.x, d.x * d.y, d.y * d.x, d.y * d.y};
    const Complex phase = std::polar(1.0, angle * (kind == 1 ? shift : shift - 1));
    for (int i = 0; i < 4; ++i) {
      const double entry = stiffness[kind] * dd[i];
      diagonal[row][i] += kind == 0 ? entry * 2 * (1 - std::cos(angle)) : entry;
      if (kind == 0) continue;
      diagonal[row + 1][i] += entry;
      above[row][i] -= entry * phase;
    }
  }
}

/// Block LDL^H of one wave number, row by row upwards.
void PeriodicInverse::eliminate(int k) {
  std::vector<Block> diagonal(static_cast<std::size_t>(width_));
  std::vector<Block> above(diagonal.size());
  for (int row = 0; row < width_; ++row) add_row(row, k, diagonal, above);
  for (int row = 0; row < width_; ++row) {
    for (const int i : {0, 1}) {
      if (present(row, i, k)) continue;
      diagonal[row][2 * i] = diagonal[row][2 * i + 1] = diagonal[row][i] = diagonal[row][2 + i] = 0;
      diagonal[row][3 * i] = 1;
      above[row][2 * i] = above[row][2 * i + 1] = 0;
      if (row > 0) above[row - 1][i] = above[row - 1][2 + i] = 0;
    }
  }
  Block schur = diagonal[0];
  for (int row = 0; row < width_; ++row) {
    const std::size_t at = static_cast<std::size_t>(row) * waves_ + k;
    inverse_[at] = invert(schur);
    if (row == width_ - 1) break;
    coupling_[at] = multiply(inverse_[at], above[row]);
    const Block update = multiply(adjoint(above[row]), coupling_[at]);
    for (int i = 0; i < 4; ++i) schur[i] = diagonal[row + 1][i] - update[i];
  }
}

/// b as a field over rows and columns, and its spectrum. At the pinned node stands what balances the other
/// loads along x, which is what its pin carries.
void PeriodicInverse::gather(std::span<const double> b) {
  double along_x = 0;
  for (int row = 0; row < width_; ++row) {
    for (int c = 0; c < components_; ++c) {
      double* const line = field_ + (static_cast<std::size_t>(row) * components_ + c) * width_;
      for (int column = 0; column < width_; ++column) {
        const Dof dof = network_.dof[(static_cast<std::size_t>(row) * width_ + column) * components_ + c];
        line[column] = dof == Network::kFixed || dof == network_.plate ? 0 : b[dof];
        if (c < components_ - 1) along_x += line[column];
      }
    }
  }
  if (slides_) field_[0] = -along_x;
  fftw_execute(forward_);
  const auto at = [this](int row, int c) { return spectrum_[wave(row, c, 0)]; };
  at(width_ - 1, components_ - 1)[0] = b[network_.plate];
  at(width_ - 1, components_ - 1)[1] = 0;
  if (slides_) at(0, 0)[0] = at(0, 0)[1] = 0;
}

/// Forward and backward substitution of all wave numbers, in place.
void PeriodicInverse::sweep() {
  auto* const value = reinterpret_cast<Complex*>(spectrum_);
  const auto get = [&](int row, int k) {
    return std::array<Complex, 2>{value[wave(row, 0, k)],
                                  components_ == 2 ? value[wave(row, 1, k)] : Complex(0)};
  };
  const auto put = [&](int row, int k, Complex first, Complex second) {
    value[wave(row, 0, k)] = first;
    if (components_ == 2) value[wave(row, 1, k)] = second;
  };
  for (int row = 0; row + 1 < width_; ++row) {
    for (int k = 0; k < waves_; ++k) {
      const Block& g = coupling_[static_cast<std::size_t>(row) * waves_ + k];
      const auto y = get(row, k);
      const auto next = get(row + 1, k);
      put(row + 1, k, next[0] - std::conj(g[0]) * y[0] - std::conj(g[2]) * y[1],
          next[1] - std::conj(g[1]) * y[0] - std::conj(g[3]) * y[1]);
    }
  }
  for (int row = width_ - 1; row >= 0; --row) {
    for (int k = 0; k < waves_; ++k) {
      const std::size_t at = static_cast<std::size_t>(row) * waves_ + k;
      const Block& s = inverse_[at];
      const Block& g = coupling_[at];
      const auto y = get(row, k);
      const auto x = row + 1 < width_ ? get(row + 1, k) : std::array<Complex, 2>{};
      put(row, k, s[0] * y[0] + s[1] * y[1] - g[0] * x[0] - g[1] * x[1],
          s[2] * y[0] + s[3] * y[1] - g[2] * x[0] - g[3] * x[1]);
    }
  }
}

void PeriodicInverse::scatter(std::span<const double> b, std::span<double> x) const {
  const double scale = 1.0 / width_;
  const double pin = slides_ ? field_[0] * scale : 0;
  for (int row = 0; row < width_; ++row) {
    for (int c = 0; c < components_; ++c) {
      const double* const line = field_ + (static_cast<std::size_t>(row) * components_ + c) * width_;
      for (int column = 0; column < width_; ++column) {
        const Dof dof = network_.dof[(static_cast<std::size_t>(row) * width_ + column) * components_ + c];
        if (dof != Network::kFixed) x[dof] = line[column] * scale - (c < components_ - 1 ? pin : 0);
      }
    }
  }
  for (const Dof slot : network_.idle) x[slot] = b[slot];
}

void PeriodicInverse::solve(std::span<const double> b, std::span<double> x) {
  gather(b);
  sweep();
  fftw_execute(backward_);
  scatter(b, x);
}

}  // namespace crackle
