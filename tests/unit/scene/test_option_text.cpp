#include <gtest/gtest.h>

#include <vector>

#include "crackle/scene/option_text.hpp"
#include "support/expect_refused.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

TEST(OptionText, HelpTellsOfEveryOptionOnce) {
  const std::string help = format_help(false);
  for (const char* name :
       {"-model", "-lattice", "-lattice_size", "-lattice_row_spacing", "-lattice_file", "-grips", "-break_on",
        "-disorder", "-samples", "-first_sample", "-seed", "-stop", "-equilibrium", "-output", "-resume",
        "-overwrite", "-record", "-record_snapshot_at", "-monitor"}) {
    const OptionText& option = find_option(name);
    EXPECT_STREQ(option.name, name);
    const std::string start = std::string("\n  ") + name + " ";
    const std::size_t at = help.find(start);
    ASSERT_NE(at, std::string::npos) << name;
    EXPECT_EQ(help.find(start, at + 1), std::string::npos) << name;
    const std::string line = help.substr(at + 1, help.find('\n', at + 1) - at - 1);
    EXPECT_NE(line.find(std::string("(") + option.standard + ")"), std::string::npos) << line;
    EXPECT_TRUE(line.ends_with(option.allowed)) << line;
  }
}

TEST(OptionText, TellsOptionsFromValuesAndWhatDecidesResults) {
  {
    for (const char* word : {"-a", "--a", "-ksp_type", "-A1"}) EXPECT_TRUE(looks_like_option(word)) << word;
    for (const char* word : {"", "-", "--", "-1", "-.5", "--1", "a", "1e-3"}) {
      EXPECT_FALSE(looks_like_option(word)) << word;
    }
  }
  {
    for (const char* name : {"-seed", "-lattice_size", "-stop", "-record", "-ksp_rtol", "-pc_type"}) {
      EXPECT_TRUE(decides_results(name)) << name;
    }
    for (const char* name : {"-samples", "-first_sample", "-output", "-resume", "-monitor", "-ksp_view",
                             "-ksp_monitor", "-ksp_converged_reason"}) {
      EXPECT_FALSE(decides_results(name)) << name;
    }
    for (const char* name : {"-ksp_rtol", "-pc_type", "-mat_mumps_icntl_24"})
      EXPECT_TRUE(reaches_solver(name));
    for (const char* name : {"-seed", "-log_view", "-kspx"}) EXPECT_FALSE(reaches_solver(name));
  }
}

TEST(OptionText, TellsHowTwoRunsDiffer) {
  const std::string ours = "-ksp_type cg\n-lattice_size 80\n-samples 9\n-seed 1\n";
  EXPECT_EQ(differing_options(ours, ours), "");
  EXPECT_EQ(differing_options(ours, "-ksp_type cg\n-lattice_size 80\n-samples 5\n-seed 1\n"), "");
  EXPECT_EQ(differing_options(ours, "-ksp_type cg\n-lattice_size 8\n-samples 9\n-seed 11\n"),
            "-lattice_size 80 (the file has 8), -seed 1 (the file has 11)");
  EXPECT_EQ(differing_options(ours, "-lattice_size 80\n-seed 1\n"), "-ksp_type cg (the file has none)");
  EXPECT_EQ(differing_options("-equilibrium_tree_kernels avx2\n", "-equilibrium_tree_kernels plain\n"),
            "-equilibrium_tree_kernels avx2 (the file has plain)");
  EXPECT_EQ(differing_options("-equilibrium_tree_kernels avx2\n-seed 1\n", "-seed 1\n"), "")
      << "a file from before there was a choice";
  EXPECT_EQ(differing_options("-seed 1\n", "-ksp_type cg\n-seed 1\n"),
            "-ksp_type not given (the file has cg)");
}

TEST(OptionText, FindsTheSolversOptions) {
  const test::SolverOptions options{{"-ksp_rtol", "1e-9"}, {"-pc_type", "bogus"}, {"-seed", "3"}};
  EXPECT_EQ(solver_options(),
            (std::map<std::string, std::string>{{"-ksp_rtol", "1e-9"}, {"-pc_type", "bogus"}}));
  EXPECT_EQ(option_named_in("Unable to find requested PC type bogus"), "-pc_type bogus");
  EXPECT_EQ(option_named_in("Unable to find requested PC type"), "");
}

TEST(OptionText, RefusesWhatNobodyReadsAndSuggestsWhatWasMeant) {
  {{const test::SolverOptions options{{"-latice_size", "8"}};
  test::expect_refused(reject_unused_options, {"-latice_size 8", "did you mean -lattice_size?"});
}
{
  const test::SolverOptions options{{"-sample", "8"}};
  test::expect_refused(reject_unused_options, {"-sample 8", "did you mean -samples?"});
}
{
  const test::SolverOptions options{{"-row_spacing_of_lattice", "8"}};
  test::expect_refused(reject_unused_options, {"-row_spacing_of_lattice 8", "crackle -help"});
  EXPECT_THROW(
      try { reject_unused_options(); } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find("did you mean"), std::string::npos) << error.what();
        throw;
      },
      InputError);
}
{
  const test::SolverOptions options{{"-lattice_file", "n.h5"}};
  test::expect_refused(reject_unused_options, {"-lattice_file n.h5", "no use here"});
}
}  // namespace
{
  const test::SolverOptions options{{"-seed", "8"}, {"-log_view", ""}, {"-options_left", "0"}};
  PetscBool set = PETSC_FALSE;
  petsc::check(PetscOptionsHasName(nullptr, nullptr, "-seed", &set));
  EXPECT_NO_THROW(reject_unused_options());
  EXPECT_NO_THROW(reject_stray_words());
}
}  // namespace crackle

}  // namespace
}  // namespace crackle
