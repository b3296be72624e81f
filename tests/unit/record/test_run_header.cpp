#include <gtest/gtest.h>

#include "crackle/record/run_header.hpp"

namespace crackle {
namespace {

RunHeader header(const char* options) {
  return {.options = options, .deciding = {"-ksp_type", "-lattice_size", "-seed", "-resume_not"}};
}

TEST(RunHeader, HasTheValueOfAnOption) {
  const std::string options = "-ksp_type cg\n-lattice_size 80\n-resume\n-seed_of 3\n-seed 1\n";
  EXPECT_EQ(option_value(options, "-lattice_size"), "80");
  EXPECT_EQ(option_value(options, "-seed"), "1") << "not of an option that begins so";
  EXPECT_EQ(option_value(options, "-resume"), "");
  EXPECT_EQ(option_value(options, "-lattice"), "");
}

TEST(RunHeader, TellsHowTwoRunsDiffer) {
  const RunHeader ours = header("-ksp_type cg\n-lattice_size 80\n-samples 9\n-seed 1\n");
  EXPECT_EQ(differing_options(ours, ours), "");
  EXPECT_EQ(differing_options(ours, header("-ksp_type cg\n-lattice_size 80\n-samples 5\n-seed 1\n")), "");
  EXPECT_EQ(differing_options(ours, header("-ksp_type cg\n-lattice_size 8\n-samples 9\n-seed 11\n")),
            "-lattice_size 80 (the file has 8), -seed 1 (the file has 11)");
  EXPECT_EQ(differing_options(ours, header("-lattice_size 80\n-seed 1\n")),
            "-ksp_type cg (the file has none)");
  EXPECT_EQ(differing_options(header("-seed 1\n"), header("-ksp_type cg\n-seed 1\n")),
            "-ksp_type not given (the file has cg)");
}

TEST(RunHeader, WhatEitherFileSaysDecidesCounts) {
  RunHeader old{.options = "-seed 1\n", .deciding = {"-seed"}};
  RunHeader now{.options = "-load shear\n-seed 1\n", .deciding = {"-load", "-seed"}};
  EXPECT_EQ(differing_options(now, old), "-load shear (the file has none)");
  EXPECT_EQ(differing_options(old, now), "-load not given (the file has shear)");
}

}  // namespace
}  // namespace crackle
