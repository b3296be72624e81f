#include "crackle/base/memory.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// The number behind a word of a file of lines "word number"; 0 where it isn't there.
double number_behind(const std::string& file, const std::string& word) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first;
    double number = 0;
    if (words >> first >> number && first == word) return number;
  }
  return 0;
}

/// The number that a file has; where it has none ("max") or isn't there, `otherwise`.
double number_in(const std::string& file, double otherwise) {
  double number = 0;
  return std::ifstream(file) >> number ? number : otherwise;
}

double left_on_machine() {
  constexpr double kKibibyte = 1024;
  const double available = number_behind("/proc/meminfo", "MemAvailable:");
  return available > 0 ? kKibibyte * (available + number_behind("/proc/meminfo", "SwapFree:")) : kNoLimit;
}

/// Pages of files that nobody uses are given back. Within a container its own group is the root of the tree.
double left_in_group() {
  const std::string second = "/sys/fs/cgroup";
  const std::string first = second + "/memory";
  std::string path;
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    if (line.starts_with("0::") || line.find(":memory:") != std::string::npos)
      path = line.substr(line.rfind(':') + 1);
  }
  double least = kNoLimit;
  for (const std::string& folder : {second, second + path, first, first + path}) {
    const bool old = folder.starts_with(first);
    const double limit = number_in(folder + (old ? "/memory.limit_in_bytes" : "/memory.max"), kNoLimit);
    const double taken = number_in(folder + (old ? "/memory.usage_in_bytes" : "/memory.current"), 0);
    const double spare =
        number_behind(folder + "/memory.stat", old ? "total_inactive_file" : "inactive_file");
    least = std::min(least, std::max(0.0, limit - taken + spare));
  }
  return least;
}

/// Processes of the run on this machine, as their launcher says.
double processes_here() {
  for (const char* name : {"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "PMI_LOCAL_SIZE"}) {
    if (const char* number = std::getenv(name)) return std::max(1.0, std::atof(number));
  }
  return 1;
}

}  // namespace

MemoryLeft memory_left() {
  const double processes = processes_here();
  const std::string share =
      processes > 1 ? ", shared by " + std::to_string(static_cast<int>(processes)) + " processes" : "";
  const std::array all = {MemoryLeft{left_on_machine() / processes, "this machine" + share},
                          MemoryLeft{left_in_group() / processes, "the control group" + share}};
  return *std::ranges::min_element(all, {}, &MemoryLeft::bytes);
}

void demand_memory(const std::string& what, double bytes) {
  const MemoryLeft left = memory_left();
  const std::string text = what + " needs " + mebibytes(bytes) + ": ";
  if (bytes > left.bytes) {
    throw InputError(text + left.limit + " leaves " + mebibytes(left.bytes) + "; " + kLessMemory);
  }
  try {
    expect_memory(static_cast<std::size_t>(bytes));  // only malloc knows which of its pages are free again
  } catch (const std::bad_alloc& error) {
    throw InputError(text + explain(error) + "; " + kLessMemory);
  }
}

}  // namespace crackle
