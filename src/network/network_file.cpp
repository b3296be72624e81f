#include "crackle/network/network_file.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <span>
#include <utility>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

constexpr double kUnbreakable = std::numeric_limits<double>::infinity();

/// Values of a dataset [..][2] as pairs.
template <class Pair, class T>
std::vector<Pair> read_pairs(hid_t file, const std::string& name) {
  std::vector<hsize_t> shape;
  const std::vector<T> values = hdf5::read<T>(file, name, &shape);
  if (shape.size() != 2 || shape[1] != 2) throw InputError("shape of dataset /" + name, "", "[..][2]");
  std::vector<Pair> pairs;
  pairs.reserve(values.size() / 2);
  for (std::size_t i = 0; i < values.size(); i += 2) pairs.push_back({values[i], values[i + 1]});
  return pairs;
}

std::vector<Vector2> read_steps(hid_t file) {
  const std::string name = "network/bonds/step";
  if (!hdf5::exists(file, name)) return {};
  return read_pairs<Vector2, double>(file, name);
}

std::vector<double> read_optional(hid_t file, const std::string& name, std::size_t bonds) {
  if (!hdf5::exists(file, name)) return {};
  std::vector<double> values = hdf5::read<double>(file, name);
  if (values.size() != bonds) {
    throw InputError("size of dataset /" + name, std::to_string(values.size()),
                     "one value for each of the " + std::to_string(bonds) + " bonds");
  }
  return values;
}

/// 0 and from `least` to `largest`; -0 becomes 0. `what`: "threshold".
void check_range(const char* what, double& value, std::size_t bond, double least, double largest) {
  if (value == 0) value = 0;
  if (value == 0 || (value >= least && value <= largest)) return;
  std::array<char, 32> digits{};
  std::array<char, 80> allowed{};
  std::snprintf(digits.data(), digits.size(), "%.6g", value);
  std::snprintf(allowed.data(), allowed.size(), "a number from 0 (0, %sfrom %g to %g)",
                largest == kLargestThreshold ? "infinity, or " : "or ", least, largest);
  throw InputError(std::string(what) + " of bond " + std::to_string(bond), digits.data(), allowed.data());
}

std::vector<double> read_stiffness(hid_t file, std::size_t bonds) {
  std::vector<double> values = read_optional(file, "network/bonds/stiffness", bonds);
  for (std::size_t e = 0; e < bonds && !values.empty(); ++e)
    check_range("stiffness", values[e], e, kLeastStiffness, kLargestStiffness);
  return values;
}

/// [M], or [S][M] row by row.
std::vector<double> read_thresholds(hid_t file, std::size_t bonds) {
  const std::string name = "network/bonds/threshold";
  if (!hdf5::exists(file, name)) return {};
  std::vector<hsize_t> shape;
  std::vector<double> values = hdf5::read<double>(file, name, &shape);
  if (bonds == 0 && values.empty()) return {};
  if (bonds == 0 || shape.empty() || shape.size() > 2 || shape.back() != bonds || values.empty()) {
    throw InputError(
        "size of dataset /" + name, std::to_string(values.size()),
        "one value for each of the " + std::to_string(bonds) + " bonds, or a row of them for each sample");
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != kUnbreakable)
      check_range("threshold", values[i], i % bonds, kLeastThreshold, kLargestThreshold);
  }
  return values;
}

Model read_model(hid_t group) {
  const double components = hdf5::read_number(group, "components");
  if (components != 1 && components != 2) {
    throw InputError("attribute components", std::to_string(components), "1 (fuse) or 2 (spring)");
  }
  return components == 1 ? Model::fuse : Model::spring;
}

NetworkFile read_group(hid_t file) {
  if (!hdf5::exists(file, "network")) throw InputError("group /network", "", "present in the file");
  const hdf5::Handle group = hdf5::open_group(file, "network");
  NetworkFile result;
  result.model = read_model(group);
  std::vector<Grip> grips;
  for (const std::int8_t mark : hdf5::read<std::int8_t>(file, "network/nodes/grip")) {
    grips.push_back(static_cast<Grip>(mark));
  }
  result.lattice =
      make_lattice(hdf5::read_number(group, "period_x"),
                   read_pairs<Vector2, double>(file, "network/nodes/position"), std::move(grips),
                   read_pairs<std::array<NodeId, 2>, NodeId>(file, "network/bonds/nodes"), read_steps(file));
  if (result.model == Model::spring) check_directions(result.lattice);
  result.stiffness = read_stiffness(file, result.lattice.bond.size());
  result.threshold = read_thresholds(file, result.lattice.bond.size());
  return result;
}

void check_rigid(const LatticeKind& lattice, Model model) {
  if (model == Model::fuse || lattice.floppy == nullptr) return;
  throw InputError(
      "-lattice", lattice.name,
      std::string("a lattice that springs make rigid (in this one ") + lattice.floppy + "), or -model fuse");
}

template <class T, class Pair>
std::vector<T> flatten(const std::vector<Pair>& pairs) {
  std::vector<T> values;
  values.reserve(2 * pairs.size());
  for (const auto& [first, second] : pairs) {
    values.push_back(first);
    values.push_back(second);
  }
  return values;
}

}  // namespace

NetworkFile read_network_file(const std::string& path) {
  const hdf5::Handle file = hdf5::open_file(path);
  try {
    return read_group(file);
  } catch (const InputError& error) {
    throw InputError("network file " + path + ": " + error.what());
  }
}

IntactNetwork load_network(const NetworkOptions& options) {
  if (options.lattice != nullptr) {
    const Model model = options.model.value_or(Model::spring);
    check_rigid(*options.lattice, model);
    Lattice lattice = options.lattice->make(options.size, options.row_spacing);
    std::vector<double> stiffness = draw_stiffness(options.stiffness, lattice);
    return {make_network(std::move(lattice), model, options.grips, std::move(stiffness)), {}};
  }
  NetworkFile file = read_network_file(options.file);
  if (options.model.value_or(file.model) != file.model) {
    throw InputError("-model", file.model == Model::fuse ? "spring" : "fuse",
                     std::string("the one of network file ") + options.file + ", " +
                         (file.model == Model::fuse ? "fuse (components 1)" : "spring (components 2)"));
  }
  try {
    return {make_network(std::move(file.lattice), file.model, options.grips, std::move(file.stiffness)),
            std::move(file.threshold)};
  } catch (const InputError& error) {
    throw InputError("network file " + options.file + ": " + error.what());
  }
}

std::string checksum(const IntactNetwork& intact) {
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](const auto& values) {
    for (const std::byte byte : std::as_bytes(std::span(values))) {
      hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3;
    }
  };
  const Lattice& lattice = intact.network.lattice;
  add(std::array{lattice.period_x});
  add(lattice.position);
  add(lattice.grip);
  add(lattice.bond);
  add(lattice.step);
  add(intact.network.stiffness);
  add(intact.threshold);
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(hash));
  return digits.data();
}

void write_network(hid_t file, const Network& network, std::span<const double> threshold) {
  const Lattice& lattice = network.lattice;
  const hdf5::Handle group = hdf5::create_group(file, "network");
  hdf5::write_attribute(group, "components", static_cast<std::int32_t>(network.components));
  hdf5::write_attribute(group, "period_x", lattice.period_x);
  const hdf5::Handle nodes = hdf5::create_group(group, "nodes");
  hdf5::write<double>(nodes, "position", flatten<double>(lattice.position), 2);
  std::vector<std::int8_t> grips;
  grips.reserve(lattice.grip.size());
  for (const Grip grip : lattice.grip) grips.push_back(static_cast<std::int8_t>(grip));
  hdf5::write<std::int8_t>(nodes, "grip", grips);
  const hdf5::Handle bonds = hdf5::create_group(group, "bonds");
  hdf5::write<NodeId>(bonds, "nodes", flatten<NodeId>(lattice.bond), 2);
  if (!lattice.step.empty()) hdf5::write<double>(bonds, "step", flatten<double>(lattice.step), 2);
  hdf5::write<double>(bonds, "stiffness", network.stiffness);
  const std::size_t samples = lattice.bond.empty() ? 0 : threshold.size() / lattice.bond.size();
  if (samples > 0) hdf5::write<double>(bonds, "threshold", threshold, samples == 1 ? 0 : lattice.bond.size());
}

}  // namespace crackle
