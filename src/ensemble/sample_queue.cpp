#include "crackle/ensemble/sample_queue.hpp"

#include <algorithm>
#include <cmath>

namespace crackle {

SampleQueue::Known& SampleQueue::known(int run) {
  if (run >= std::ssize(known_)) known_.resize(static_cast<std::size_t>(run) + 1);
  return known_[run];
}

void SampleQueue::append(int run, std::int64_t first, std::int64_t end,
                         const std::set<std::int64_t>& finished) {
  const auto piece = [&](std::int64_t from, std::int64_t to) {
    if (from >= to) return;
    pieces_.push_back({run, from, to - from});
    known(run).left += to - from;
  };
  known(run);
  for (auto at = finished.lower_bound(first); at != finished.end() && *at < end; ++at) {
    piece(first, *at);
    first = *at + 1;
  }
  piece(first, end);
}

void SampleQueue::note(int run, std::int64_t samples, double seconds) {
  known(run).samples += samples;
  known(run).seconds += seconds;
}

std::optional<Chunk> SampleQueue::take() {
  if (pieces_.empty()) return std::nullopt;
  Chunk& piece = pieces_.front();
  const double each = seconds_per_sample(piece.run);
  const double fits = each > 0 ? kChunkSeconds / each : 1;
  const std::int64_t fair = left(piece.run) / (2 * static_cast<std::int64_t>(workers_));
  const auto most = static_cast<std::int64_t>(std::min(fits, 1e6));
  const std::int64_t count = std::clamp(std::min(most, fair), std::int64_t{1}, piece.count);
  const Chunk taken{piece.run, piece.first, count};
  known(piece.run).left -= count;
  piece.first += count;
  piece.count -= count;
  if (piece.count == 0) pieces_.pop_front();
  return taken;
}

std::int64_t SampleQueue::left(int run) const {
  return run < std::ssize(known_) ? known_[run].left : 0;
}

double SampleQueue::seconds_per_sample(int run) const {
  if (run >= std::ssize(known_) || known_[run].samples == 0) return 0;
  return known_[run].seconds / static_cast<double>(known_[run].samples);
}

}  // namespace crackle
