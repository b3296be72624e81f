#include <gtest/gtest.h>

#include "crackle/scene/option_table.hpp"
#include "crackle/scene/scene.hpp"
#include "support/expect_refused.hpp"
#include "support/solver_options.hpp"

namespace crackle {
namespace {

TEST(Scene, WithoutOptionsIsThePapersAtSizeSixteen) {
  const Scene scene = read_scenes().front();
  EXPECT_EQ(scene.network.lattice, &lattice_kinds().front());
  EXPECT_EQ(scene.network.size, 16);
  EXPECT_EQ(scene.network.row_spacing, 1);
  EXPECT_EQ(scene.network.model, Model::spring);
  EXPECT_EQ(scene.network.grips, Grips::sliding);
  EXPECT_FALSE(scene.disorder.from_file);
  EXPECT_EQ(scene.disorder.seed, 1u);
  EXPECT_EQ(scene.equilibrium.common.break_on, BreakOn::magnitude);
  EXPECT_FALSE(scene.equilibrium.common.many_samples);
  EXPECT_EQ(scene.ensemble.samples, 1);
  EXPECT_EQ(scene.ensemble.first_sample, 0);
  EXPECT_EQ(scene.ensemble.stop.kind, StopRule::Kind::failure);
  EXPECT_EQ(scene.output.path, "crackle.h5");
  EXPECT_FALSE(scene.output.resume || scene.output.overwrite);
  EXPECT_TRUE(scene.output.record.has("breaks"));
  EXPECT_FALSE(scene.output.record.has("profile") || scene.output.record.has("snapshot") ||
               scene.output.record.network);
}

TEST(Scene, TakesAndEchoesWhatIsGiven) {
  const test::SolverOptions options{{"-model", "fuse"},
                                    {"-lattice_size", "9"},
                                    {"-break_on", "tension"},
                                    {"-stop", "stiffness=0.25"},
                                    {"-samples", "3"},
                                    {"-record", "profile,snapshot"},
                                    {"-ksp_rtol", "1e-9"},
                                    {"-record_snapshot_at", "7,2"},
                                    {"-seed", "18446744073709551615"}};
  const Scene scene = read_scenes().front();
  EXPECT_EQ(scene.network.model, Model::fuse);
  EXPECT_EQ(scene.network.size, 9);
  EXPECT_EQ(scene.equilibrium.common.break_on, BreakOn::tension);
  EXPECT_EQ(scene.ensemble.stop.kind, StopRule::Kind::stiffness);
  EXPECT_EQ(scene.ensemble.stop.value, 0.25);
  EXPECT_TRUE(scene.equilibrium.common.many_samples);
  EXPECT_EQ(scene.disorder.seed, ~std::uint64_t{0});
  EXPECT_FALSE(scene.output.record.has("breaks"));
  EXPECT_EQ(scene.output.record.snapshot_at, (std::vector<std::int32_t>{2, 7}));
  EXPECT_EQ(scene.options.at("-model"), "fuse");
  EXPECT_EQ(scene.options.at("-lattice_size"), "9");
  EXPECT_EQ(scene.options.at("-ksp_rtol"), "1e-9");
  EXPECT_EQ(scene.options.at("-grips"), "sliding") << "defaults, too";
  EXPECT_FALSE(scene.options.contains("-lattice_file")) << "of no use here";
}

TEST(Scene, RefusesEveryValueThatIsNotAllowed) {
  const std::vector<std::pair<std::string, std::string>> wrong = {{"-model", "beam"},
                                                                  {"-lattice", "cubic"},
                                                                  {"-lattice_size", "0"},
                                                                  {"-lattice_size", "8193"},
                                                                  {"-lattice_size", "4.5"},
                                                                  {"-lattice_size", "ten"},
                                                                  {"-lattice_size", "1e3"},
                                                                  {"-lattice_row_spacing", "0"},
                                                                  {"-lattice_row_spacing", "-1"},
                                                                  {"-seed", "-1"},
                                                                  {"-lattice_row_spacing", "nan"},
                                                                  {"-lattice_row_spacing", "inf"},
                                                                  {"-grips", "loose"},
                                                                  {"-break_on", "shear"},
                                                                  {"-disorder", "normal"},
                                                                  {"-stiffness", "soft"},
                                                                  {"-lattice_dilution", "1"},
                                                                  {"-disorder_zero_share", "1.5"},
                                                                  {"-lattice_dilution", "-0.1"},
                                                                  {"-equilibrium_check", "-1"},
                                                                  {"-samples", "0"},
                                                                  {"-first_sample", "-1"},
                                                                  {"-seed", "18446744073709551616"},
                                                                  {"-stop", "peak"},
                                                                  {"-stop", "breaks=-1"},
                                                                  {"-stop", "breaks=1.5"},
                                                                  {"-stop", "stiffness=2"},
                                                                  {"-stop", "stiffness="},
                                                                  {"-stop", "displacement=-1"},
                                                                  {"-record", "all"},
                                                                  {"-record", "breaks,none"},
                                                                  {"-monitor", "loud"}};
  for (const auto& [name, value] : wrong) {
    SCOPED_TRACE(name + " " + value);
    const test::SolverOptions options{{name, value}};
    test::expect_refused([] { (void)read_scenes(); }, {name, value, allowed_of(name)});
  }
  const std::vector<std::pair<std::string, std::string>> incomplete = {
      {"-lattice", "file"}, {"-disorder", "file"}, {"-record", "snapshot"}, {"-stop", ""}};
  for (const auto& [name, value] : incomplete) {
    SCOPED_TRACE(name + " " + value);
    const test::SolverOptions options{{name, value}};
    test::expect_refused([] { (void)read_scenes(); }, {name, "allowed is"});
  }
}

}  // namespace
}  // namespace crackle
