/// What stands at the head of a run file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "crackle/network/network.hpp"

namespace crackle {

struct RunHeader {
  std::string options;                  ///< every option of the run, "-name value" a line, sorted by name
  std::vector<std::string> deciding{};  ///< names of those whose other value gives other results
  std::string checksum{};               ///< of a network from a file, which -resume compares; else empty
  NodeId nodes = 0;                     ///< N; 0: not told, like the next two
  std::int32_t components = 0;          ///< c
  BondId bonds = 0;                     ///< M
  const Network* network = nullptr;     ///< for -record network; else null
  std::vector<double> threshold{};      ///< written with it; may be empty
};

/// The value of an option in RunHeader::options; empty: not among them, or without one.
[[nodiscard]] std::string option_value(const std::string& options, const std::string& name);

/// Options of two runs that decide results (in either) and differ: "-seed 2 (the file has 1)", with commas between; empty
/// when the two may be one run.
[[nodiscard]] std::string differing_options(const RunHeader& ours, const RunHeader& theirs);

}  // namespace crackle
