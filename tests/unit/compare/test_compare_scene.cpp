#include <gtest/gtest.h>

#include "crackle/compare/compare_scene.hpp"
#include "crackle/scene/option_table.hpp"
#include "support/expect_refused.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

class ComparisonOptions : public testing::Test {
 protected:
  void SetUp() override { use_options(compare_options()); }  // as crackle_compare does
};

TEST_F(ComparisonOptions, TakesDefaultsAndEchoesThem) {
  const test::SolverOptions given{{"-compare", "a.opts,b.opts"}};
  Scene scene = read_compared_scene();
  const CompareOptions options = read_comparison(scene);
  EXPECT_EQ(options.files, (std::vector<std::string>{"a.opts", "b.opts"}));
  EXPECT_TRUE(options.tolerances.empty());
  EXPECT_EQ(options.every, 10);
  EXPECT_EQ(options.repetitions, 3);
  EXPECT_EQ(options.skip, 0);
  EXPECT_EQ(options.along, Along::reference);
  EXPECT_EQ(options.reference, ReferenceKind::automatic);
  EXPECT_EQ(options.path, "compare.h5") << "not crackle's";
  EXPECT_FALSE(options.overwrite || options.quiet);
  EXPECT_EQ(scene.options.at("-output"), "compare.h5");
  EXPECT_EQ(scene.options.at("-compare_along"), "reference");
  EXPECT_EQ(scene.options.at("-compare_every"), "10");
  EXPECT_EQ(scene.options.at("-lattice_size"), "16");
}

TEST_F(ComparisonOptions, TakesWhatIsGiven) {
  const test::SolverOptions given{{"-compare", "a.opts"},
                                  {"-compare_rtol", "1e-2,0.5"},
                                  {"-compare_every", "3"},
                                  {"-compare_repetitions", "2"},
                                  {"-compare_skip", "7"},
                                  {"-compare_along", "own"},
                                  {"-compare_reference", "refined"},
                                  {"-output", "crackle.h5"},
                                  {"-overwrite", "true"},
                                  {"-monitor", "none"},
                                  {"-stop", "breaks=40"}};
  Scene scene = read_compared_scene();
  const CompareOptions options = read_comparison(scene);
  EXPECT_EQ(options.tolerances, (std::vector<std::string>{"1e-2", "0.5"}));
  EXPECT_EQ(options.every, 3);
  EXPECT_EQ(options.repetitions, 2);
  EXPECT_EQ(options.skip, 7);
  EXPECT_EQ(options.along, Along::own);
  EXPECT_EQ(options.reference, ReferenceKind::refined);
  EXPECT_EQ(options.path, "crackle.h5") << "given, if it is crackle's default";
  EXPECT_TRUE(options.overwrite && options.quiet);
  EXPECT_EQ(scene.options.at("-compare_rtol"), "1e-2,0.5");
}

TEST_F(ComparisonOptions, RefusesEveryValueThatIsNotAllowed) {
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"-compare_rtol", "0"},          {"-compare_rtol", "1"},        {"-compare_rtol", "1e-2,-1e-3"},
      {"-compare_rtol", "1e-2,nan"},   {"-compare_rtol", "1e-2,,1"},  {"-compare_rtol", "small"},
      {"-compare_every", "0"},         {"-compare_every", "1.5"},     {"-compare_repetitions", "0"},
      {"-compare_skip", "-1"},         {"-compare_along", "its own"}, {"-compare_reference", "dense"},
      {"-compare_repetitions", "1e9"},
  };
  for (const auto& [name, value] : wrong) {
    SCOPED_TRACE(value);
    const test::SolverOptions given{{"-compare", "a.opts"}, {name, value}};
    Scene scene = read_compared_scene();
    test::expect_refused([&] { (void)read_comparison(scene); }, {name, "allowed is"});
  }
}

/// What crackle can and a comparison can't: one sample of one size, from its start to failure or a number of breaks.
TEST_F(ComparisonOptions, RefusesWhatAComparisonHasNoUseFor) {
  using Given = std::pair<std::string, std::string>;
  for (const Given& option : {Given{"-samples", "2"}, Given{"-stop", "stiffness=0.5"},
                              Given{"-stop", "displacement=2"}, Given{"-resume", "true"}}) {
    SCOPED_TRACE(option.first);
    const test::SolverOptions given{{"-compare", "a.opts"}, option};
    Scene scene = read_compared_scene();
    test::expect_refused([&] { (void)read_comparison(scene); }, {option.first, "comparison"});
  }
  {
    const test::SolverOptions given{{"-compare", "a.opts"}, {"-lattice_size", "4,5"}};
    test::expect_refused([] { (void)read_compared_scene(); }, {"-lattice_size 4,5", "one size"});
  }
  Scene scene = read_compared_scene();
  test::expect_refused([&] { (void)read_comparison(scene); },
                       {"-compare", "not given", "files of solver options"});
}

}  // namespace
}  // namespace crackle
