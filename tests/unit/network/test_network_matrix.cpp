#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "crackle/network/lattices.hpp"
#include "crackle/network/network_matrix.hpp"
#include "support/dense_reference.hpp"
#include "support/small_networks.hpp"

namespace crackle {
namespace {

using petsc::check;

/// All entries, by rows, 0 where the matrix has none.
std::vector<double> entries(const NetworkMatrix& matrix) {
  PetscInt n = 0;
  check(MatGetSize(matrix.get(), &n, nullptr));
  std::vector<PetscInt> all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  std::vector<double> values(all.size() * all.size());
  check(MatGetValues(matrix.get(), n, all.data(), n, all.data(), values.data()));
  return values;
}

std::vector<double> multiply(const NetworkMatrix& matrix, const std::vector<double>& u) {
  petsc::VecHandle x;
  petsc::VecHandle y;
  check(MatCreateVecs(matrix.get(), x.out(), y.out()));
  double* values = nullptr;
  check(VecGetArray(x, &values));
  std::copy(u.begin(), u.end(), values);
  check(VecRestoreArray(x, &values));
  check(MatMult(matrix.get(), x, y));
  const double* product = nullptr;
  check(VecGetArrayRead(y, &product));
  std::vector<double> result(product, product + u.size());
  check(VecRestoreArrayRead(y, &product));
  return result;
}

TEST(NetworkMatrix, MultipliesAsTheBondsDo) {
  for (const int size : {1, 2, 4}) {
    for (const test::NamedNetwork& named : test::triangular_networks(size)) {
      SCOPED_TRACE(named.name + " " + std::to_string(size));
      const Network& network = named.network;
      const NetworkMatrix matrix(network);
      const std::vector<double> u = test::mixed_values(static_cast<std::size_t>(network.unknowns));
      const std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
      std::vector<double> r(u.size());
      residual(network, broken, u, r);
      const std::vector<double> product = multiply(matrix, u);
      for (Dof dof = 0; dof < network.unknowns; ++dof) {
        const double load = dof == network.plate ? 1 : 0;
        EXPECT_NEAR(product[dof], load - r[dof], 1e-14) << dof;
      }
    }
  }
}

TEST(NetworkMatrix, IsTheDenseMatrixAndSymmetricToTheLastBit) {
  {
    for (const test::NamedNetwork& named : test::triangular_networks(3)) {
      SCOPED_TRACE(named.name);
      const std::vector<double> values = entries(NetworkMatrix(named.network));
      const test::DenseMatrix K = test::dense_matrix(named.network);
      ASSERT_EQ(values.size(), K.value.size());
      for (std::size_t i = 0; i < values.size(); ++i)
        ASSERT_NEAR(values[i], static_cast<double>(K.value[i]), 1e-14);
    }
  }
  {
    for (const test::NamedNetwork& named : test::triangular_networks(4)) {
      SCOPED_TRACE(named.name);
      const NetworkMatrix matrix(named.network);
      const std::vector<double> values = entries(matrix);
      const auto n = static_cast<std::size_t>(named.network.unknowns);
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < i; ++j) ASSERT_EQ(values[i * n + j], values[j * n + i]) << i << " " << j;
      }
      PetscInt block_size = 0;
      check(MatGetBlockSize(matrix.get(), &block_size));
      EXPECT_EQ(block_size, named.network.components);
      PetscBool is_seqaij = PETSC_FALSE;
      check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(matrix.get()), MATSEQAIJ, &is_seqaij));
      EXPECT_EQ(is_seqaij, PETSC_TRUE);
    }
  }
}

/// Three nodes in a row, each joined to the other two and to the plate: no entry that no bond makes.
TEST(NetworkMatrix, StoresNoMoreThanTheBondsMake) {
  const Network network = make_network(triangular_lattice(2, 1), Model::fuse, Grips::sliding, {});
  const NetworkMatrix matrix(network);
  MatInfo info{};
  check(MatGetInfo(matrix.get(), MAT_LOCAL, &info));
  EXPECT_EQ(info.nz_used, 16);
  EXPECT_EQ(info.nz_allocated, 16);
  EXPECT_EQ(info.mallocs, 0);
}

/// The same network with these bonds of no stiffness from the start.
Network without(const Network& network, const std::vector<BondId>& bonds) {
  std::vector<double> stiffness = network.stiffness;
  for (const BondId e : bonds) stiffness[e] = 0;
  return make_network(network.lattice, network.model, network.grips, stiffness);
}

TEST(NetworkMatrix, AfterBreaksIsBitForBitAFreshAssembly) {
  for (const test::NamedNetwork& named : test::triangular_networks(4)) {
    SCOPED_TRACE(named.name);
    const Network& network = named.network;
    NetworkMatrix matrix(network);
    std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
    std::vector<BondId> removed;
    for (const BondId e : test::safe_removals(network, 10)) {
      broken[e] = 1;
      removed.push_back(e);
      matrix.update({&e, 1}, broken);
      const Network fresh = without(network, removed);
      ASSERT_EQ(fresh.idle, network.idle);
      ASSERT_EQ(entries(matrix), entries(NetworkMatrix(fresh))) << removed.size() << " breaks";
    }
    EXPECT_EQ(removed.size(), 10u);
  }
}

/// A subtraction of 1e12 would leave an error of 1e-4 in the entries.
TEST(NetworkMatrix, ForgetsABrokenBondHoweverStiff) {
  const Lattice lattice = triangular_lattice(4, 1);
  std::vector<double> stiffness(lattice.bond.size(), 1.0);
  const std::vector<BondId> stiff{17, 22, 31};
  for (const BondId e : stiff) stiffness[e] = 1e12;
  const Network network = make_network(lattice, Model::spring, Grips::sliding, stiffness);
  NetworkMatrix matrix(network);
  std::vector<std::uint8_t> broken(lattice.bond.size(), 0);
  for (const BondId e : stiff) {
    broken[e] = 1;
    matrix.update({&e, 1}, broken);
  }
  EXPECT_EQ(entries(matrix), entries(NetworkMatrix(without(network, stiff))));
}

TEST(NetworkMatrix, GoesBackToTheIntactNetwork) {
  const Network network = test::triangular_networks(4).back().network;
  NetworkMatrix matrix(network);
  const std::vector<double> intact = entries(matrix);
  std::vector<std::uint8_t> broken(network.lattice.bond.size(), 0);
  const std::vector<BondId> removed{3, 20, 21, 22, 40};
  for (const BondId e : removed) broken[e] = 1;
  matrix.update(removed, broken);
  EXPECT_NE(entries(matrix), intact);
  matrix.update(removed, std::vector<std::uint8_t>(broken.size(), 0));
  EXPECT_EQ(entries(matrix), intact);
}

}  // namespace
}  // namespace crackle
