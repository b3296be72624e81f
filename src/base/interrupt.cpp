#include "crackle/base/interrupt.hpp"

#include <csignal>
#include <initializer_list>

namespace crackle {

namespace {

volatile std::sig_atomic_t caught = 0;  // NOLINT(*-non-const-global-*): all that a signal can reach

extern "C" void note(int signal) {
  if (caught != 0) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);  // comes when this function has returned
  }
  caught = signal;
}

void catch_one(int signal) {
  struct sigaction action {};
  if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler == SIG_IGN) return;  // nohup, &
  action = {};
  action.sa_handler = note;
  action.sa_flags = SA_RESTART;
  sigaction(signal, &action, nullptr);
}

}  // namespace

void catch_interrupts() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) catch_one(signal);
}

void ignore_file_size_limit() {
  std::signal(SIGXFSZ, SIG_IGN);
}

int interrupt_signal() {
  return caught;
}

}  // namespace crackle
