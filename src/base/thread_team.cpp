#include "crackle/base/thread_team.hpp"

#include <signal.h>

#include <cassert>
#include <system_error>
#include <utility>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

/// While it lives, threads are started that take no signal but those of their own faults: signals are for the main thread,
/// whose calls they interrupt.
class SignalsKept {
 public:
  SignalsKept() {
    sigset_t all;
    sigfillset(&all);
    for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL}) sigdelset(&all, fault);
    pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~SignalsKept() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsKept(const SignalsKept&) = delete;
  SignalsKept& operator=(const SignalsKept&) = delete;

 private:
  sigset_t before_{};
};

/// Waits a while for a condition; false: it doesn't hold yet. Who else wants the core goes first.
template <class Condition>
bool comes_soon(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + ThreadTeam::kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::yield();
  }
  return true;
}

}  // namespace

ThreadTeam::ThreadTeam(int threads, const std::string& option) {
  assert(threads >= 1 && threads <= kMost);
  const SignalsKept kept;
  helper_.reserve(static_cast<std::size_t>(threads) - 1);
  try {
    for (int member = 1; member < threads; ++member) helper_.emplace_back([this, member] { help(member); });
  } catch (const std::system_error&) {
    const int started = this->threads();
    dismiss();
    throw InputError(option, std::to_string(threads),
                     "1 to " + std::to_string(started) + ": the system starts no more");
  }
}

ThreadTeam::~ThreadTeam() {
  dismiss();
}

void ThreadTeam::dismiss() {
  {
    const std::lock_guard lock(mutex_);
    dismissed_ = true;
  }
  work_.notify_all();
  for (std::thread& helper : helper_) helper.join();
}

void ThreadTeam::run(const Loop& loop) {
  assert(unfinished_ == 0);
  loop_ = loop;
  unfinished_ = loop.count;
  left_ = loop.count;
  // Either a helper that goes to sleep sees the turns, or it is counted here: both orders are sequentially consistent.
  if (asleep_ > 0) {
    const std::lock_guard lock(mutex_);
    work_.notify_all();
  }
  while (take_turn(0)) continue;
  const auto all_ended = [this] { return unfinished_ == 0; };
  if (!comes_soon(all_ended)) {
    std::unique_lock lock(mutex_);
    done_.wait(lock, all_ended);
  }
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

/// False: there was none.
bool ThreadTeam::take_turn(int member) {
  int left = left_;
  do {
    if (left == 0) return false;
  } while (!left_.compare_exchange_weak(left, left - 1));
  const int turn = loop_.count - left;
  try {
    loop_.act(loop_.context, turn, member);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!failure_ || turn < failed_turn_) {
      failure_ = std::current_exception();
      failed_turn_ = turn;
    }
  }
  if (unfinished_.fetch_sub(1) == 1 && member > 0) {
    const std::lock_guard lock(mutex_);
    done_.notify_one();
  }
  return true;
}

void ThreadTeam::help(int member) {
  const auto wanted = [this] { return left_ > 0; };
  while (true) {
    while (take_turn(member)) continue;
    if (comes_soon(wanted)) continue;
    std::unique_lock lock(mutex_);
    ++asleep_;
    work_.wait(lock, [&] { return dismissed_ || wanted(); });
    --asleep_;
    if (dismissed_) return;
  }
}

}  // namespace crackle
