/// PETSc at the edge: a session, owners for its objects, error codes turned into exceptions.
#pragma once

#include <petscksp.h>

#include <source_location>
#include <string>
#include <utility>

namespace crackle::petsc {

/// MPI and PETSc, from construction to destruction. Every other PETSc object must die before it.
///
/// A single process (no mpirun) starts only what it needs of Open MPI, five times faster. PETSc's errors
/// print nothing; `check` throws what they say. BLAS gets one thread unless OPENBLAS_NUM_THREADS or
/// OMP_NUM_THREADS is set: samples, not BLAS calls, are what runs in parallel.
class Session {
 public:
  /// `help` is what -help prints before PETSc's own options; it must outlive the session.
  Session(int& argc, char**& argv, const char* help);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// True in the process that speaks for all.
  [[nodiscard]] bool first() const { return first_; }

 private:
  bool first_ = true;
};

/// Throws std::runtime_error with PETSc's message and the place of the call when `code` is not 0.
void check(PetscErrorCode code, std::source_location where = std::source_location::current());

/// What PETSc said last when something went wrong (its initial message, one line).
[[nodiscard]] const std::string& last_message();

/// The stage of -log_view that the program is in, until `next` or the end of its life.
class LogStage {
 public:
  explicit LogStage(const char* name);
  ~LogStage() { PetscLogStagePop(); }
  LogStage(const LogStage&) = delete;
  LogStage& operator=(const LogStage&) = delete;

  void next(const char* name);
};

/// Owns one PETSc object.
template <class Object, PetscErrorCode (*destroy)(Object*)>
class Handle {
 public:
  Handle() = default;
  ~Handle() { destroy(&object_); }
  Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  operator Object() const { return object_; }  // NOLINT(*-explicit-*): handed to PETSc's functions as it is
  /// For PETSc's creating functions.
  [[nodiscard]] Object* out() { return &object_; }

 private:
  Object object_ = nullptr;
};

using MatHandle = Handle<Mat, MatDestroy>;
using VecHandle = Handle<Vec, VecDestroy>;
using NullSpaceHandle = Handle<MatNullSpace, MatNullSpaceDestroy>;
using KspHandle = Handle<KSP, KSPDestroy>;
using ScatterHandle = Handle<VecScatter, VecScatterDestroy>;

}  // namespace crackle::petsc
