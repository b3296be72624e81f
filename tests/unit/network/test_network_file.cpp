#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <set>

#include "crackle/network/network_file.hpp"
#include "support/expect_refused.hpp"
#include "support/hdf5_file.hpp"
#include "support/small_networks.hpp"
#include "support/temporary_folder.hpp"

namespace crackle {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A network file, part by part: two springs up through three nodes. A width of 0 makes a dataset flat.
struct Parts {
  std::int32_t components = 2;
  std::vector<double> position{0, 0, 0, 1, 0, 2};
  std::size_t position_width = 2;
  std::vector<std::int8_t> grip{1, 0, 2};
  std::vector<NodeId> nodes{0, 1, 1, 2};
  std::size_t nodes_width = 2;
  std::vector<double> stiffness{1, 1};
  std::vector<double> threshold{0.5, 0.5};
  std::string left_out;  ///< the one part that is not written
};

void write_parts(const std::string& path, const Parts& parts) {
  test::write_hdf5(path, [&parts](hid_t file) {
    const auto wanted = [&](const char* name) { return parts.left_out != name; };
    if (!wanted("network")) return;
    const hdf5::Handle group = hdf5::create_group(file, "network");
    const hdf5::Handle nodes = hdf5::create_group(group, "nodes");
    const hdf5::Handle bonds = hdf5::create_group(group, "bonds");
    if (wanted("components")) hdf5::write_attribute(group, "components", parts.components);
    if (wanted("period_x")) hdf5::write_attribute(group, "period_x", 0.0);
    if (wanted("position")) hdf5::write<double>(nodes, "position", parts.position, parts.position_width);
    if (wanted("grip")) hdf5::write<std::int8_t>(nodes, "grip", parts.grip);
    if (wanted("nodes")) hdf5::write<NodeId>(bonds, "nodes", parts.nodes, parts.nodes_width);
    if (wanted("stiffness")) hdf5::write<double>(bonds, "stiffness", parts.stiffness);
    if (wanted("threshold")) hdf5::write<double>(bonds, "threshold", parts.threshold);
  });
}

NetworkOptions from_file(const std::string& path) {
  NetworkOptions options;
  options.lattice = nullptr;
  options.file = path;
  return options;
}

void expect_equal(const Network& read, const Network& written) {
  EXPECT_EQ(read.model, written.model);
  EXPECT_EQ(read.lattice.period_x, written.lattice.period_x);
  EXPECT_EQ(read.lattice.bond, written.lattice.bond);
  EXPECT_EQ(read.lattice.grip, written.lattice.grip);
  ASSERT_EQ(read.lattice.nodes(), written.lattice.nodes());
  for (NodeId node = 0; node < read.lattice.nodes(); ++node) {
    EXPECT_EQ(read.lattice.position[node].x, written.lattice.position[node].x);
    EXPECT_EQ(read.lattice.position[node].y, written.lattice.position[node].y);
  }
  EXPECT_EQ(read.stiffness, written.stiffness);
  EXPECT_EQ(read.bond_dof, written.bond_dof);
  EXPECT_EQ(read.bond_value, written.bond_value);
}

TEST(NetworkFile, WhatIsWrittenIsReadBitForBit) {
  const test::TemporaryFolder folder;
  for (const test::NamedNetwork& named : test::triangular_networks(4)) {
    SCOPED_TRACE(named.name);
    std::vector<double> threshold(named.network.lattice.bond.size());
    draw_uniform_thresholds(1, 0, threshold);
    const std::string path = folder.path("network.h5");
    test::write_hdf5(path, [&](hid_t file) { write_network(file, named.network, threshold); });
    NetworkOptions options = from_file(path);
    options.grips = named.network.grips;
    const IntactNetwork read = load_network(options);
    expect_equal(read.network, named.network);
    EXPECT_EQ(read.threshold, threshold);
  }
}

TEST(NetworkFile, WithoutStiffnessesAndThresholdsTakesOnesAndNone) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("network.h5");
  write_parts(path, {.left_out = "stiffness"});
  EXPECT_EQ(load_network(from_file(path)).network.stiffness, (std::vector{1.0, 1.0}));
  write_parts(path, {.left_out = "threshold"});
  EXPECT_TRUE(load_network(from_file(path)).threshold.empty());
  const Network network = test::bundle(2);
  test::write_hdf5(path, [&](hid_t file) { write_network(file, network, {}); });
  EXPECT_FALSE(hdf5::exists(hdf5::open_file(path), "network/bonds/threshold"));
}

TEST(NetworkFile, GeneratesATriangularLatticeOtherwise) {
  const IntactNetwork intact = load_network({.size = 3, .row_spacing = 0.5, .grips = Grips::clamped});
  expect_equal(intact.network, make_network(triangular_lattice(3, 0.5), Model::spring, Grips::clamped, {}));
  EXPECT_TRUE(intact.threshold.empty());
  EXPECT_EQ(load_network({.size = 3, .model = Model::fuse}).network.components, 1);
}

TEST(NetworkFile, ChecksumSeesEveryBit) {
  const IntactNetwork intact{test::bundle(3, {1, 2, 3}), {0.1, 0.2, 0.3}};
  EXPECT_EQ(checksum(intact).size(), 16u);
  EXPECT_EQ(checksum(intact), checksum(IntactNetwork(intact)));
  std::set<std::string> seen{checksum(intact)};
  const auto add = [&](auto change) {
    IntactNetwork other = intact;
    change(other);
    seen.insert(checksum(other));
  };
  add([](IntactNetwork& n) { n.threshold[1] = std::nextafter(0.2, 1); });
  add([](IntactNetwork& n) { n.threshold.clear(); });
  add([](IntactNetwork& n) { n.network.stiffness[2] = std::nextafter(3.0, 4); });
  add([](IntactNetwork& n) { n.network.lattice.position[1].y = std::nextafter(1.0, 2); });
  add([](IntactNetwork& n) { n.network.lattice.period_x = 1; });
  add([](IntactNetwork& n) { n.network.lattice.grip[0] = Grip::free; });
  add([](IntactNetwork& n) { n.network.lattice.bond[0] = {1, 0}; });
  EXPECT_EQ(seen.size(), 8u);
}

struct Refusal {
  std::function<void(Parts&)> spoil;
  std::vector<std::string> message;
};

/// Each spoilt file is refused by a message that names it.
void expect_refusals(const std::vector<Refusal>& refusals) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("network.h5");
  for (Refusal refusal : refusals) {
    Parts parts;
    refusal.spoil(parts);
    write_parts(path, parts);
    SCOPED_TRACE(refusal.message.front());
    refusal.message.push_back(path);
    test::expect_refused([&] { (void)load_network(from_file(path)); }, refusal.message);
  }
}

TEST(NetworkFile, RefusesWhatIsNoNetwork) {
  expect_refusals({
      {[](Parts& p) { p.nodes[3] = 3; }, {"node 3 of bond 1", "0 to 2"}},
      {[](Parts& p) { p.nodes[2] = -1; }, {"node -1 of bond 1"}},
      {[](Parts& p) { p.nodes[3] = 1; }, {"bond 1", "two different nodes"}},
      {[](Parts& p) { p.position[5] = 1; }, {"length of bond 1"}},
      {[](Parts& p) { p.position[5] = kNan; }, {"position of node 2"}},
      {[](Parts& p) { p.stiffness[1] = kNan; }, {"stiffness of bond 1", "nan"}},
      {[](Parts& p) { p.stiffness[1] = -2; }, {"stiffness of bond 1", "-2"}},
      {[](Parts& p) { p.threshold[1] = kNan; }, {"threshold of bond 1", "nan"}},
      {[](Parts& p) { p.threshold[1] = -2; }, {"threshold of bond 1", "-2"}},
      {[](Parts& p) { p.grip[0] = 0; }, {"grip", "bottom"}},
      {[](Parts& p) { p.grip[2] = 0; }, {"grip", "top"}},
      {[](Parts& p) { p.grip[1] = 7; }, {"grip of node 1", "7"}},
      {[](Parts& p) { p.stiffness[1] = 0; }, {"path", "grips"}},
      {[](Parts& p) {
         p.nodes = {};
         p.stiffness = p.threshold = {};
       },
       {"path", "grips"}},
      {[](Parts& p) { p.components = 3; }, {"components", "3", "1 (fuse) or 2 (spring)"}},
  });
}

TEST(NetworkFile, RefusesWrongShapesAndWhatIsLeftOut) {
  expect_refusals({
      {[](Parts& p) { p.position_width = 3; }, {"/network/nodes/position", "[..][2]"}},
      {[](Parts& p) { p.position_width = 0; }, {"/network/nodes/position", "[..][2]"}},
      {[](Parts& p) { p.nodes_width = 4; }, {"/network/bonds/nodes", "[..][2]"}},
      {[](Parts& p) { p.nodes_width = 0; }, {"/network/bonds/nodes", "[..][2]"}},
      {[](Parts& p) { p.grip.push_back(0); }, {"grip", "4", "3 nodes"}},
      {[](Parts& p) { p.stiffness.push_back(1); }, {"/network/bonds/stiffness", "3", "2 bonds"}},
      {[](Parts& p) { p.threshold.pop_back(); }, {"/network/bonds/threshold", "1", "2 bonds"}},
      {[](Parts& p) { p.left_out = "network"; }, {"/network", "present"}},
      {[](Parts& p) { p.left_out = "components"; }, {"attribute components"}},
      {[](Parts& p) { p.left_out = "period_x"; }, {"attribute period_x"}},
      {[](Parts& p) { p.left_out = "position"; }, {"/network/nodes/position"}},
      {[](Parts& p) { p.left_out = "grip"; }, {"/network/nodes/grip"}},
      {[](Parts& p) { p.left_out = "nodes"; }, {"/network/bonds/nodes"}},
  });
}

TEST(NetworkFile, RefusesFilesThatAreNotWholeOrContradictTheModel) {
  {
    const test::TemporaryFolder folder;
    const std::string path = folder.path("network.h5");
    const auto read = [&] { (void)load_network(from_file(path)); };
    test::expect_refused(read, {path, "exists"});
    std::ofstream(path) << "position,grip\n";
    test::expect_refused(read, {path, "HDF5"});
    write_parts(path, {});
    EXPECT_NO_THROW(read());
    std::filesystem::resize_file(path, std::filesystem::file_size(path) - 100);
    test::expect_refused(read, {path, "whole"});
  }
  {
    const test::TemporaryFolder folder;
    NetworkOptions options = from_file(folder.path("network.h5"));
    write_parts(options.file, {});
    options.model = Model::spring;
    EXPECT_EQ(load_network(options).network.components, 2);
    options.model = Model::fuse;
    test::expect_refused([&] { (void)load_network(options); }, {"-model", "fuse", options.file, "spring"});
  }
}

}  // namespace
}  // namespace crackle
