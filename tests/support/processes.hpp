/// The processes that a test runs in: one, or as many as mpirun has started.
#pragma once

#include <mpi.h>

#include <vector>

namespace crackle::test {

/// Sizes of groups that the processes can be shared out in.
inline std::vector<int> group_sizes() {
  int processes = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &processes);
  std::vector<int> sizes;
  for (int size = 1; size <= processes; ++size) {
    if (processes % size == 0) sizes.push_back(size);
  }
  return sizes;
}

}  // namespace crackle::test
