/// What a process may still take, asked before something large is made.
#pragma once

#include <string>

namespace crackle {

/// Bytes that this process may still take, and what leaves no more.
struct MemoryLeft {
  double bytes = 0;
  std::string limit;  ///< "this machine", "the control group", "..., shared by 4 processes"
};

/// The less of the machine's available memory and swap and what the control group leaves, shared evenly by the run's
/// processes on the machine. A limit that can't be read is none.
[[nodiscard]] MemoryLeft memory_left();

/// Throws InputError when `bytes` is more than that, or than the limit on address space lets one have in a piece: "-equilibrium dense of 18818 unknowns needs 2702 MiB: allowed is ...",
/// with both figures and what to try. To be called before the memory is taken: the system would promise it, and kill later.
void demand_memory(const std::string& what, double bytes);

}  // namespace crackle
