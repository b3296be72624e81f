#include "crackle/ensemble/hand_out.hpp"

#include <algorithm>
#include <exception>
#include <thread>
#include <type_traits>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/base/interrupt.hpp"

namespace crackle {

namespace {

constexpr int kTag = 1;
/// Between two looks for messages while breaking, and while waiting for nothing else.
constexpr std::chrono::microseconds kLookEvery{200};
constexpr std::chrono::microseconds kSleep{50};

template <class T>
void send(const T& message, int to, MPI_Comm comm) {
  static_assert(std::is_trivially_copyable_v<T>);
  MPI_Send(&message, sizeof message, MPI_BYTE, to, kTag, comm);
}

template <class T>
T receive(int from, MPI_Comm comm) {
  T message;
  MPI_Recv(&message, sizeof message, MPI_BYTE, from, kTag, comm, MPI_STATUS_IGNORE);
  return message;
}

/// The sender of a message that has come; -1: none has.
int message_from(int from, MPI_Comm comm) {
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(from, kTag, comm, &there, &status);
  return there != 0 ? status.MPI_SOURCE : -1;
}

template <std::size_t size>
void copy_text(const std::string& text, std::array<char, size>& to) {
  to.fill(0);
  std::copy_n(text.begin(), std::min(text.size(), size - 1), to.begin());
}

}  // namespace

struct HandOut::Question {
  enum class Kind : std::uint8_t { next, claim, farewell } kind = Kind::next;
  Report report;
};

/// From the first process to another leader.
struct HandOut::Message {
  bool unasked = false;  ///< the run ends early; else the answer to the last question
  Answer answer;
};

HandOut::HandOut(const Ranks& ranks, SampleQueue& queue, Progress& progress, std::function<void(int)> claim)
    : ranks_(ranks),
      queue_(queue),
      progress_(progress),
      claim_(std::move(claim)),
      last_look_(Clock::now()),
      here_(static_cast<std::size_t>(ranks.groups()), true) {}

Answer HandOut::next(const Report& report) {
  Answer answer;
  if (ranks_.first()) {
    look_for_questions();
    answer = serve(with_troubles(report));
  } else if (ranks_.leader()) {
    answer = converse({Question::Kind::next, with_troubles(report)}).answer;
  }
  ranks_.share(answer);
  return answer;
}

bool HandOut::claim(int run) {
  Report report = with_troubles({});
  report.run = run;
  report.waiting = true;
  if (ranks_.first()) return take_note(report);
  return converse({Question::Kind::claim, report}).answer.claimed;
}

HandOut::Message HandOut::converse(const Question& question) {
  send(question, 0, ranks_.leaders());
  while (true) {
    while (message_from(0, ranks_.leaders()) < 0) std::this_thread::sleep_for(kSleep);
    const auto message = receive<Message>(0, ranks_.leaders());
    if (!message.unasked) return message;
    stopping_ = true;
  }
}

bool HandOut::stopping() {
  if (ranks_.leader()) {
    if (interrupt_signal() != 0) stopping_ = true;
    if (ranks_.groups() > 1 && Clock::now() - last_look_ >= kLookEvery) {
      last_look_ = Clock::now();
      if (ranks_.first()) {
        look_for_questions();
      } else if (message_from(0, ranks_.leaders()) == 0) {  // unasked: it can only be one kind
        (void)receive<Message>(0, ranks_.leaders());
        stopping_ = true;
      }
    }
  }
  ranks_.share(stopping_);
  return stopping_;
}

void HandOut::fail(const std::string& complaint) {
  stopping_ = true;
  if (complaint_[0] == 0) copy_text(complaint, complaint_);
}

Report HandOut::with_troubles(Report report) const {
  report.signal = interrupt_signal();
  report.complaint = complaint_;
  return report;
}

/// In the first process: takes note of a report; true: its run's output may be written.
bool HandOut::take_note(const Report& report) {
  queue_.note(report.run, report.finished, report.seconds);
  progress_.add(report.saved_run, report.saved, queue_.seconds_per_sample(report.saved_run));
  if (end_.signal == 0) end_.signal = report.signal;
  if (end_.complaint[0] == 0) end_.complaint = report.complaint;
  bool claimed = false;
  try {
    if (report.waiting) claim_(report.run);
    claimed = report.waiting;
  } catch (const std::exception& error) {
    if (end_.complaint[0] == 0) copy_text(explain(error), end_.complaint);
  }
  if (end_.signal != 0 || end_.complaint[0] != 0) tell_all_to_stop();
  return claimed;
}

Answer HandOut::serve(const Report& report) {
  Answer answer;
  answer.claimed = take_note(report);
  const std::optional<Chunk> chunk = stopping_ ? std::nullopt : queue_.take();
  answer.work = chunk.has_value();
  if (chunk) answer.chunk = *chunk;
  return answer;
}

void HandOut::tell_all_to_stop() {
  stopping_ = true;
  if (std::exchange(told_, true)) return;
  for (int leader = 1; leader < ranks_.groups(); ++leader) {
    if (here_[leader]) send(Message{.unasked = true, .answer = {}}, leader, ranks_.leaders());
  }
}

void HandOut::look_for_questions() {
  if (ranks_.groups() == 1) return;
  for (int leader = 0; (leader = message_from(MPI_ANY_SOURCE, ranks_.leaders())) >= 0;) {
    answer(leader, receive<Question>(leader, ranks_.leaders()));
  }
}

void HandOut::answer(int leader, const Question& question) {
  Message message;
  if (question.kind == Question::Kind::next) {
    message.answer = serve(question.report);
  } else {
    if (question.kind == Question::Kind::farewell) here_[leader] = false;
    message.answer.claimed = take_note(question.report);
  }
  send(message, leader, ranks_.leaders());
}

RunEnd HandOut::leave(Report report) {
  report = with_troubles(report);
  if (ranks_.first()) {
    here_[0] = false;
    (void)take_note(report);
    while (std::ranges::find(here_, true) != here_.end()) {
      look_for_questions();
      std::this_thread::sleep_for(kSleep);
    }
  } else if (ranks_.leader()) {
    (void)converse({Question::Kind::farewell, report});
  }
  MPI_Bcast(&end_, sizeof end_, MPI_BYTE, 0, ranks_.world());
  return end_;
}

}  // namespace crackle
