#include "crackle/base/ranks.hpp"

#include <algorithm>
#include <exception>
#include <string>
#include <utility>

#include "crackle/base/error.hpp"

namespace crackle {

Communicator::~Communicator() {
  int ended = 0;
  MPI_Finalized(&ended);
  if (comm_ != MPI_COMM_NULL && ended == 0) MPI_Comm_free(&comm_);
}

Communicator::Communicator(Communicator&& other) noexcept
    : comm_(std::exchange(other.comm_, MPI_COMM_NULL)) {}

Communicator& Communicator::operator=(Communicator&& other) noexcept {
  std::swap(comm_, other.comm_);
  return *this;
}

Communicator Communicator::split(MPI_Comm whole, int colour) {
  Communicator part;
  MPI_Comm_split(whole, colour, 0, &part.comm_);
  return part;
}

Ranks::Ranks(MPI_Comm world, int group_size) : group_size_(group_size) {
  MPI_Comm_rank(world, &rank_);
  MPI_Comm_size(world, &processes_);
  if (processes_ % group_size != 0) {
    throw InputError("-ensemble_ranks_per_sample", std::to_string(group_size),
                     "a divisor of the number of processes, " + std::to_string(processes_));
  }
  world_ = Communicator::split(world, 0);
  group_ = Communicator::split(world, group_number());
  leaders_ = Communicator::split(world, leader() ? 0 : 1);
}

void Ranks::together(const std::function<void()>& work) const {
  if (processes_ == 1) {
    work();
    return;
  }
  std::string complaint;
  try {
    work();
  } catch (const std::exception& error) {
    complaint = explain(error);
    if (complaint.empty()) complaint = "an error without a message";
  }
  const int mine = complaint.empty() ? processes_ : rank_;
  int first = processes_;
  MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, world_);
  if (first == processes_) return;
  int size = static_cast<int>(complaint.size());
  MPI_Bcast(&size, 1, MPI_INT, first, world_);
  complaint.resize(static_cast<std::size_t>(size));
  MPI_Bcast(complaint.data(), size, MPI_CHAR, first, world_);
  throw InputError(complaint);
}

void Ranks::share_bytes(void* data, std::size_t bytes) const {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // MPI counts in int
  auto* at = static_cast<char*>(data);
  for (std::size_t done = 0; done < bytes; done += kMost) {
    MPI_Bcast(at + done, static_cast<int>(std::min(kMost, bytes - done)), MPI_BYTE, 0, group_);
  }
}

}  // namespace crackle
