#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "crackle/base/petsc_handle.hpp"
#include "crackle/compare/compare_strategy.hpp"
#include "support/expect_refused.hpp"
#include "support/solver_options.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

using Options = std::map<std::string, std::string>;

/// Files of options in a folder of their own.
class SolverFiles {
 public:
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path(name)) << text;
    return folder_.path(name);
  }
  [[nodiscard]] std::string path(const std::string& name = "") const { return folder_.path(name); }

 private:
  test::TemporaryFolder folder_;
};

std::vector<std::string> names_of(const std::vector<StrategyChoice>& choices) {
  std::vector<std::string> names;
  names.reserve(choices.size());
  for (const StrategyChoice& choice : choices) names.push_back(choice.name);
  return names;
}

TEST(CompareStrategy, ReadsWhatAFileGives) {
  SolverFiles files;
  const std::vector<std::string> paths{
      files.write("some.opts",
                  "# a comment\n-pc_type cholesky\n\n-shift -1e-8 # below 0\n"
                  "-ksp_initial_guess_nonzero\n-words \"two words\"\n"),
      files.write("mine.txt", "-equilibrium tree\n")};
  const std::vector<StrategyChoice> choices = choose_strategies(paths, {});
  ASSERT_EQ(names_of(choices), (std::vector<std::string>{"some", "mine"}));
  EXPECT_EQ(choices[0].file, paths[0]);
  EXPECT_EQ(choices[0].rtol, "");
  EXPECT_EQ(choices[0].options, (Options{{"-pc_type", "cholesky"},
                                         {"-shift", "-1e-8"},
                                         {"-ksp_initial_guess_nonzero", ""},
                                         {"-words", "two words"}}));
  EXPECT_EQ(choices[1].options, (Options{{"-equilibrium", "tree"}}));
}

TEST(CompareStrategy, OnlyIterationsTakeTolerances) {
  SolverFiles files;
  const std::vector<std::string> paths{files.write("cg.opts", "-ksp_type cg\n-ksp_rtol 1e-3\n"),
                                       files.write("direct.opts", "-ksp_type preonly\n-pc_type updown\n"),
                                       files.write("tree.opts", "-equilibrium tree\n")};
  const std::vector<std::string> tolerances{"1e-2", "1.0e-12"};
  const std::vector<StrategyChoice> choices = choose_strategies(paths, tolerances);
  ASSERT_EQ(names_of(choices), (std::vector<std::string>{"cg 1e-2", "cg 1.0e-12", "direct", "tree"}));
  for (const int i : {0, 1}) {
    EXPECT_EQ(choices[i].rtol, tolerances[i]);
    EXPECT_EQ(choices[i].options, (Options{{"-ksp_type", "cg"}, {"-ksp_rtol", tolerances[i]}}));
  }
  for (const int i : {2, 3}) {
    EXPECT_EQ(choices[i].rtol, "");
    EXPECT_FALSE(choices[i].options.contains("-ksp_rtol"));
  }
  EXPECT_EQ(choose_strategies(paths, {})[0].options.at("-ksp_rtol"), "1e-3") << "the file's own";
}

TEST(CompareStrategy, RefusesFilesThatCanNotBeRead) {
  SolverFiles files;
  std::filesystem::create_directory(files.path("folder"));
  for (const std::string& name : {files.path("nowhere.opts"), files.path("folder")}) {
    test::expect_refused([&] { (void)choose_strategies(std::vector{name}, {}); }, {"-compare", name});
  }
  const std::string file = files.write("bad.opts", "-ksp_type cg\npc_type jacobi\n");
  test::expect_refused([&] { (void)choose_strategies(std::vector{file}, {}); }, {file, "line 2"});
}

/// The database's value of an option; "-" for one that isn't there.
std::string in_database(const char* name) {
  const char* value = nullptr;
  PetscBool set = PETSC_FALSE;
  petsc::check(PetscOptionsFindPair(nullptr, nullptr, name, &value, &set));
  if (set == PETSC_FALSE) return "-";
  return value == nullptr ? "" : value;
}

TEST(CompareStrategy, OptionsHideOthersForTheirLife) {
  const test::SolverOptions given{{"-ksp_type", "cg"}, {"-ksp_rtol", "1e-3"}};
  petsc::check(PetscOptionsSetValue(nullptr, "-pc_flag", nullptr));
  const StrategyChoice choice{
      "some", "some.opts", "", {{"-ksp_type", "preonly"}, {"-pc_flag", "no"}, {"-mat_new", ""}}};
  const auto expect_before = [] {
    EXPECT_EQ(in_database("-ksp_type"), "cg");
    EXPECT_EQ(in_database("-pc_flag"), "");
    EXPECT_EQ(in_database("-mat_new"), "-");
    EXPECT_EQ(in_database("-ksp_rtol"), "1e-3");
  };
  expect_before();
  try {
    const StrategyOptions options(choice);
    EXPECT_EQ(in_database("-ksp_type"), "preonly");
    EXPECT_EQ(in_database("-pc_flag"), "no");
    EXPECT_EQ(in_database("-mat_new"), "");
    EXPECT_EQ(in_database("-ksp_rtol"), "1e-3");
    throw InputError("whatever ends it");
  } catch (const InputError&) {
    expect_before();
  }
  petsc::check(PetscOptionsClearValue(nullptr, "-pc_flag"));
}

}  // namespace
}  // namespace crackle
