#include <gtest/gtest.h>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/equilibrium/ksp/preconditioner_kind.hpp"
#include "support/leak_check.hpp"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  crackle::test::ignore_leaks();
  const crackle::petsc::Session session(argc, argv, "The unit tests of crackle.\n");
  crackle::test::note_leaks();
  crackle::register_preconditioners();
  const int failed = RUN_ALL_TESTS();
  crackle::test::check_leaks();
  return failed;
}
