/// Threads of this process that share the turns of a loop.
///
/// They are std::thread's, not OpenMP's: libgomp's own waiting can't be seen by ThreadSanitizer, which then finds a race in
/// every loop; a Session switches OpenMP off below CHOLMOD; and its threads spin for long where processes are as many as
/// cores. Here who waits yields the core at once, and sleeps after kPatience.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace crackle {

class ThreadTeam {
 public:
  static constexpr int kMost = 256;
  /// Between two loops of a front's elimination pass some microseconds; falling asleep and waking up costs as much.
  static constexpr std::chrono::microseconds kPatience{50};

  /// Starts threads - 1 (threads: 1 .. kMost); the caller is the first member. Throws InputError about `option` when the
  /// system starts no more.
  explicit ThreadTeam(int threads = 1, const std::string& option = "threads");
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  [[nodiscard]] int threads() const { return static_cast<int>(helper_.size()) + 1; }

  /// act(turn, member) for every turn 0 .. count - 1, once each, begun in that order by whichever member (0 .. threads - 1)
  /// is free. On return all of them have ended, and what they wrote can be read. When turns throw, the exception of the
  /// lowest comes out, and some of the higher ones may not have been taken. With one thread it is a plain loop. Allocates
  /// nothing. Only to be called by the thread that made the team, and not from within a turn.
  template <class Act>
  void for_each(int count, const Act& act) {
    if (helper_.empty() || count < 2) {
      for (int turn = 0; turn < count; ++turn) act(turn, 0);
      return;
    }
    run({[](const void* context, int turn, int member) { (*static_cast<const Act*>(context))(turn, member); },
         &act, count});
  }

 private:
  struct Loop {
    void (*act)(const void* context, int turn, int member) = nullptr;
    const void* context = nullptr;
    int count = 0;
  };

  void run(const Loop& loop);
  bool take_turn(int member);
  void help(int member);
  void dismiss();

  // Who has taken a turn of left_ keeps the loop alive by it: loop_ is only written while all turns have ended.
  Loop loop_;
  std::atomic<int> left_ = 0;        // turns that nobody has taken
  std::atomic<int> unfinished_ = 0;  // turns that haven't ended
  std::atomic<int> asleep_ = 0;      // helpers
  std::mutex mutex_;                 // of what follows
  std::condition_variable work_;     // left_ > 0, or dismissed_
  std::condition_variable done_;     // unfinished_ == 0
  bool dismissed_ = false;
  std::exception_ptr failure_;
  int failed_turn_ = 0;
  std::vector<std::thread> helper_;
};

}  // namespace crackle
