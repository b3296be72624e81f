#include "crackle/base/petsc_handle.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>

#include "crackle/base/error.hpp"

extern "C" void openblas_set_num_threads(int threads) __attribute__((weak));
extern "C" void omp_set_max_active_levels(int levels) __attribute__((weak));
extern "C" void* blas_memory_alloc(int position) __attribute__((weak));
extern "C" void blas_memory_free(void* buffer) __attribute__((weak));

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
  // the folder would be the same for all of them, and starts side by side would trip over it
  setenv("OMPI_MCA_orte_create_session_dirs", "0", 0);
}

/// What the user says of their number; 0: nothing.
int threads_named() {
  int most = 0;
  for (const char* variable : {"OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"}) {
    const char* const number = std::getenv(variable);
    if (number != nullptr) most = std::max({most, std::atoi(number), 1});
  }
  return most;
}

/// OpenBLAS makes its threads, of 128 MiB each, before main. Where address space is limited the program begins again with
/// one, before they have taken it.
void begin_again_where_space_is_limited(char** argv) {
  rlimit limit{};
  if (openblas_set_num_threads == nullptr || threads_named() > 0) return;
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  execv("/proc/self/exe", argv);
}

/// OpenBLAS takes its workspace in its first call, and asks again for ever when there is none; Open MPI prints pages. So
/// both must find room now.
void make_sure_of_memory() {
  constexpr std::size_t kWorkspace = std::size_t{130} << 20;  // 128 MiB and a little, on every x86-64
  constexpr std::size_t kStart = std::size_t{64} << 20;       // of MPI and PETSc: half of it is used
  with_memory_for("the start: 128 MiB of workspace for OpenBLAS, 64 MiB for MPI and PETSc",
                  [] { expect_memory(kWorkspace + kStart); });
  if (blas_memory_alloc != nullptr && blas_memory_free != nullptr) blas_memory_free(blas_memory_alloc(0));
}

/// Signals that are left as they were: PETSc would make crash reports of them, and forget that nohup ignores them.
constexpr std::array kOurs = {SIGHUP, SIGINT, SIGTERM, SIGPIPE};

class KeptSignals {
 public:
  KeptSignals() {
    for (std::size_t i = 0; i < kOurs.size(); ++i) sigaction(kOurs[i], nullptr, &before_[i]);
    sigset_t pipe;
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe, &mask_);  // `crackle -help | head` ends here, but quietly, later
  }
  ~KeptSignals() {
    for (std::size_t i = 0; i < kOurs.size(); ++i) sigaction(kOurs[i], &before_[i], nullptr);
    pthread_sigmask(SIG_SETMASK, &mask_, nullptr);
  }
  KeptSignals(const KeptSignals&) = delete;
  KeptSignals& operator=(const KeptSignals&) = delete;

 private:
  std::array<struct sigaction, kOurs.size()> before_{};
  sigset_t mask_{};
};

PetscLogStage register_stage(const char* name) {
  PetscLogStage stage = 0;
  check(PetscLogStageRegister(name, &stage));
  return stage;
}

}  // namespace

Session::Session(int& argc, char**& argv, const char* help) {
  start_light();
  begin_again_where_space_is_limited(argv);
  if (openblas_set_num_threads != nullptr && threads_named() <= 1) openblas_set_num_threads(1);
  // CHOLMOD asks for four threads whatever the number set; its loops are too short for any
  if (omp_set_max_active_levels != nullptr && threads_named() <= 1) omp_set_max_active_levels(0);
  make_sure_of_memory();
  // Before PETSc starts, as an options file may be missing; never popped, as PETSc may have changed its
  // malloc.
  PetscPushErrorHandler(keep_message, nullptr);
  {
    const KeptSignals signals;
    check(PetscInitialize(&argc, &argv, nullptr, help));
  }
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  first_ = rank == 0;
}

Session::~Session() {
  PetscFinalize();
}

void check(PetscErrorCode code, std::source_location where) {
  if (code == 0) return;
  const char* text = nullptr;
  PetscErrorMessage(code, &text, nullptr);
  std::string what = message().empty() ? (text == nullptr ? "unknown error" : text) : message();
  const std::string file = where.file_name();
  what += " (PETSc error " + std::to_string(code) + ", " + file.substr(file.rfind('/') + 1) + ":" +
          std::to_string(where.line()) + ")";
  throw std::runtime_error(what);
}

LogStage::LogStage(const char* name) {
  check(PetscLogStagePush(register_stage(name)));
}

void LogStage::next(const char* name) {
  check(PetscLogStagePop());
  check(PetscLogStagePush(register_stage(name)));
}

const std::string& last_message() {
  return message();
}

}  // namespace crackle::petsc
