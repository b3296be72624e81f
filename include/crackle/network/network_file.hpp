/// Networks in HDF5: the group /network of a network file, and of a run file with `-record network`.
///
///     /network                  attributes: components (1: fuse, 2: spring), period_x (0: not periodic)
///     /network/nodes/position   float64[N][2]
///     /network/nodes/grip       int8[N]     0 free, 1 bottom, 2 top
///     /network/bonds/nodes      int32[M][2]
///     /network/bonds/step       float64[M][2]  optional: the way from a bond's first node to its second; default: to
///                                              the nearest image, and for springs there must be one
///     /network/bonds/stiffness  float64[M]  optional, default 1
///     /network/bonds/threshold  float64[M]  optional: what -disorder file reads; or [S][M]: sample s has row s
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/hdf5_handle.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/network/network.hpp"

namespace crackle {

struct NetworkFile {
  Model model = Model::spring;
  Lattice lattice;
  std::vector<double> stiffness;  ///< empty: not in the file
  std::vector<double> threshold;  ///< [M] or [S * M]; empty: not in the file
};

/// Where a network comes from: the network options of the command line.
struct NetworkOptions {
  const LatticeKind* lattice = &lattice_kinds().front();  ///< null: read `file`
  int size = 16;                                          ///< L
  double row_spacing = 1;                                 ///< in lattice spacings along x
  StiffnessOptions stiffness;                             ///< of a generated lattice
  std::string file;                                       ///< a network file
  std::optional<Model> model;                             ///< not given: spring, or what the file says
  Grips grips = Grips::sliding;
};

/// An intact network, and the thresholds that came with it: of one sample, or of one after the other (empty: none did).
struct IntactNetwork {
  Network network;
  std::vector<double> threshold;
};

/// Generates or reads the network. Throws InputError for springs on a lattice that is for fuses only, InputError as read_network_file and make_network do, and when the
/// file's components contradict `model`.
[[nodiscard]] IntactNetwork load_network(const NetworkOptions& options);

/// A number for everything that decides how it breaks: geometry, stiffnesses, thresholds (FNV-1a, 16 hex
/// digits).
[[nodiscard]] std::string checksum(const IntactNetwork& intact);

/// Throws InputError, naming file and what is wrong, for a file that is missing, truncated or not HDF5, lacks
/// a dataset, has one of a wrong shape, or holds what make_lattice or, for springs, check_directions refuses;
/// for thresholds and stiffnesses that are NaN, negative or outside the range that disorder.hpp gives.
[[nodiscard]] NetworkFile read_network_file(const std::string& path);

/// Writes /network into an open file; without thresholds when they are empty.
void write_network(hid_t file, const Network& network, std::span<const double> threshold);

}  // namespace crackle
