#include "crackle/petsc_handle.hpp"

#include <cstdlib>
#include <stdexcept>

extern "C" void openblas_set_num_threads(int threads) __attribute__((weak));

namespace crackle::petsc {

namespace {

std::string& message() {
  static std::string text;
  return text;
}

/// Keeps the first message of an error on its way up, prints nothing.
PetscErrorCode keep_message(MPI_Comm /*comm*/, int /*line*/, const char* /*function*/, const char* /*file*/,
                            PetscErrorCode code, PetscErrorType type, const char* text, void* /*context*/) {
  if (type == PETSC_ERROR_INITIAL) {
    message() = text == nullptr ? "" : text;
    const auto end = message().find_last_not_of(" \n");
    message().erase(end == std::string::npos ? 0 : end + 1);
  }
  return code;
}

/// Open MPI without its launcher, network and shared memory: 66 ms instead of 360 ms. `btl=self` would abort
/// under mpirun, which sets these variables.
void start_light() {
  if (std::getenv("OMPI_COMM_WORLD_SIZE") != nullptr || std::getenv("PMIX_RANK") != nullptr) return;
  setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
  setenv("OMPI_MCA_pml", "ob1", 0);
  setenv("OMPI_MCA_btl", "self", 0);
}

}  // namespace

Session::Session(int& argc, char**& argv, const char* help) {
  start_light();
  const bool threads_wanted =
      std::getenv("OPENBLAS_NUM_THREADS") != nullptr || std::getenv("OMP_NUM_THREADS") != nullptr;
  if (openblas_set_num_threads != nullptr && !threads_wanted) openblas_set_num_threads(1);
  PetscPushErrorHandler(keep_message, nullptr);  // first: an options file may be missing
  check(PetscInitialize(&argc, &argv, nullptr, help));
}

Session::~Session() {
  PetscPopErrorHandler();
  PetscFinalize();
}

void check(PetscErrorCode code, std::source_location where) {
  if (code == 0) return;
  const char* text = nullptr;
  PetscErrorMessage(code, &text, nullptr);
  std::string what = message().empty() ? (text == nullptr ? "unknown error" : text) : message();
  what += " (PETSc error " + std::to_string(code) + " in " + where.function_name() + ")";
  throw std::runtime_error(what);
}

const std::string& last_message() {
  return message();
}

}  // namespace crackle::petsc
