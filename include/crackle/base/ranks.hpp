/// The processes of a run: MPI at the edge.
///
/// They come in groups of equal size; a group breaks one sample at a time, together. The first process of a group
/// leads it: it alone records and writes. The first group's leader also hands out the samples.
#pragma once

#include <mpi.h>

#include <functional>
#include <type_traits>
#include <vector>

namespace crackle {

/// Owns one communicator.
class Communicator {
 public:
  Communicator() = default;
  ~Communicator();
  Communicator(Communicator&& other) noexcept;
  Communicator& operator=(Communicator&& other) noexcept;
  operator MPI_Comm() const { return comm_; }  // NOLINT(*-explicit-*): handed to MPI's functions as it is

  /// The processes of `whole` that give the same colour, in their order.
  [[nodiscard]] static Communicator split(MPI_Comm whole, int colour);

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;
};

class Ranks {
 public:
  /// Collective over `world`. Throws InputError when the processes can't be shared out in groups of group_size.
  Ranks(MPI_Comm world, int group_size);

  [[nodiscard]] MPI_Comm world() const { return world_; }
  [[nodiscard]] MPI_Comm group() const { return group_; }
  /// The leaders among themselves, in the order of their groups; what others get here is of no use.
  [[nodiscard]] MPI_Comm leaders() const { return leaders_; }

  [[nodiscard]] int processes() const { return processes_; }
  [[nodiscard]] int group_size() const { return group_size_; }
  [[nodiscard]] int groups() const { return processes_ / group_size_; }
  [[nodiscard]] int group_number() const { return rank_ / group_size_; }
  [[nodiscard]] bool leader() const { return rank_ % group_size_ == 0; }
  /// The process that speaks for all.
  [[nodiscard]] bool first() const { return rank_ == 0; }

  /// Runs `work` in every process; when it throws in any, InputError with the first such process's message in all. (A
  /// process alone lets through what was thrown.)
  void together(const std::function<void()>& work) const;

  /// The leader's value in all of the group.
  template <class T>
  void share(T& value) const {
    static_assert(std::is_trivially_copyable_v<T>);
    if (group_size_ > 1) share_bytes(&value, sizeof value);
  }
  /// Of a vector that has the same size in all.
  template <class T>
  void share(std::vector<T>& values) const {
    static_assert(std::is_trivially_copyable_v<T>);
    if (group_size_ > 1) share_bytes(values.data(), values.size() * sizeof(T));
  }

 private:
  void share_bytes(void* data, std::size_t bytes) const;

  int rank_ = 0;
  int processes_ = 1;
  int group_size_ = 1;
  Communicator world_, group_, leaders_;
};

}  // namespace crackle
