#include <gtest/gtest.h>

#include "crackle/base/petsc_handle.hpp"
#include "support/expect_refused.hpp"

namespace crackle {
namespace {

TEST(PetscHandle, ChecksThrowWhatPetscSaysAndWhere) {
  EXPECT_NO_THROW(petsc::check(0));
  petsc::VecHandle vector;
  petsc::check(VecCreateSeq(PETSC_COMM_SELF, 3, vector.out()));
  test::expect_refused<std::runtime_error>(
      [&] { petsc::check(VecSetType(vector, "crooked")); },
      {"Unknown vector type: crooked", "PETSc error 86", "test_petsc_handle.cpp"});
  EXPECT_EQ(petsc::last_message(), "Unknown vector type: crooked");
}

PetscInt owners(Vec vector) {
  PetscInt count = 0;
  petsc::check(PetscObjectGetReference(reinterpret_cast<PetscObject>(vector), &count));
  return count;
}

TEST(PetscHandle, ReleasesWhatItOwnsOnce) {
  petsc::VecHandle kept;
  petsc::check(VecCreateSeq(PETSC_COMM_SELF, 3, kept.out()));
  {
    petsc::VecHandle second;
    *second.out() = kept;
    petsc::check(PetscObjectReference(reinterpret_cast<PetscObject>(static_cast<Vec>(kept))));
    EXPECT_EQ(owners(kept), 2);
    petsc::VecHandle third = std::move(second);
    second = std::move(third);
    EXPECT_EQ(owners(kept), 2) << "moves neither add nor release";
  }
  EXPECT_EQ(owners(kept), 1);
}

}  // namespace
}  // namespace crackle
