#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "crackle/base/option_database.hpp"
#include "crackle/compare/compare_scene.hpp"
#include "crackle/scene/option_table.hpp"
#include "support/expect_refused.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

TEST(OptionTable, HelpTellsOfEveryOptionOnce) {
  use_options(compare_options());
  const std::string help = format_help();
  std::vector<Option> all(options().begin(), options().end());
  all.insert(all.end(), compare_options().begin(), compare_options().end());
  EXPECT_GE(all.size(), 39);
  for (const Option& option : all) {
    EXPECT_EQ(&find_option(option.name), find_named(options(), option.name) != nullptr
                                             ? find_named(options(), option.name)
                                             : find_named(compare_options(), option.name));
    const std::string start = std::string("\n  ") + option.name + " ";
    const std::size_t at = help.find(start);
    ASSERT_NE(at, std::string::npos) << option.name;
    EXPECT_EQ(help.find(start, at + 1), std::string::npos) << option.name;
    const std::string line = help.substr(at + 1, help.find('\n', at + 1) - at - 1);
    EXPECT_NE(line.find(std::string("(") + option.standard + ")"), std::string::npos) << line;
    EXPECT_NE(line.find(meaning_of(option)), std::string::npos) << line;
    EXPECT_TRUE(line.ends_with(describe(option.allowed))) << line;
  }
}

TEST(OptionTable, DefaultsAreAllowed) {
  for (const Option& option : options()) {
    SCOPED_TRACE(option.name);
    const std::string value = option.standard;
    switch (option.allowed.kind) {
      case Allowed::Kind::words:
      case Allowed::Kind::any_words:
        EXPECT_EQ(std::ranges::count(option.allowed.words(), value), 1);
        break;
      case Allowed::Kind::integer:
      case Allowed::Kind::number:
        EXPECT_TRUE(value.empty() || is_within(option.allowed, std::stod(value)));
        EXPECT_LE(option.allowed.least, option.allowed.most);
        break;
      case Allowed::Kind::flag:
        EXPECT_EQ(value, "false");
        break;
      case Allowed::Kind::text:
        EXPECT_STRNE(option.allowed.text, "");
        break;
    }
  }
}

TEST(OptionTable, SaysWhatIsAllowedAndHoldsToIt) {
  using namespace allow;
  EXPECT_EQ(describe(integer(1, 8192, Allowed::Many::sizes)),
            "an integer from 1 to 8192, or several with commas between");
  EXPECT_EQ(describe(integer(0, kNoBound, Allowed::Many::each_size)),
            "an integer from 0, or one for each size");
  EXPECT_EQ(describe(number_above(0)), "a number above 0");
  EXPECT_EQ(describe(number_below(0, 1)), "a number from 0 to below 1");
  EXPECT_EQ(describe(number(1e-50, 1e50)), "a number from 1e-50 to 1e50");
  EXPECT_EQ(allowed_of("-model"), "spring or fuse");
  for (const double value : {-1.0, 0.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(is_within(number_above(0), value)) << value;
  }
  EXPECT_TRUE(is_within(number(0, 1), 1));
  EXPECT_FALSE(is_within(number_below(0, 1), 1));
  EXPECT_FALSE(is_within(integer(0), std::numeric_limits<double>::infinity()));
}

TEST(OptionTable, TellsOptionsFromValuesAndWhatDecidesResults) {
  {
    for (const char* word : {"-a", "--a", "-ksp_type", "-A1", "-info", "-inf_x"})
      EXPECT_TRUE(looks_like_option(word)) << word;
    for (const char* word : {"", "-", "--", "-1", "-.5", "--1", "a", "1e-3", "-inf", "-nan", "-Infinity"}) {
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

TEST(OptionTable, FindsTheSolversOptions) {
  const test::SolverOptions options{{"-ksp_rtol", "1e-9"}, {"-pc_type", "bogus"}, {"-seed", "3"}};
  EXPECT_EQ(solver_options(),
            (std::map<std::string, std::string>{{"-ksp_rtol", "1e-9"}, {"-pc_type", "bogus"}}));
  EXPECT_EQ(option_named_in("Unable to find requested PC type bogus"), "-pc_type bogus");
  EXPECT_EQ(option_named_in("Unable to find requested PC type"), "");
}

TEST(OptionTable, RefusesWhatNobodyReadsAndSuggestsWhatWasMeant) {
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
