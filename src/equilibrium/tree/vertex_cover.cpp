#include "crackle/equilibrium/tree/vertex_cover.hpp"

#include <algorithm>
#include <span>

namespace crackle {

namespace {

constexpr std::int32_t kNone = -1;

class Matching {
 public:
  explicit Matching(const CoupledPairs& pairs)
      : pairs_(pairs), mate_(pairs.lefts(), kNone), partner_(pairs.rights, kNone), layer_(pairs.lefts()) {
    next_.resize(pairs.lefts());
    while (find_layers()) {
      std::copy_n(pairs_.start.begin(), pairs_.lefts(), next_.begin());
      for (std::int32_t i = 0; i < pairs_.lefts(); ++i) {
        if (mate_[i] == kNone) augment(i);
      }
    }
  }

  /// After the last layering: left vertices no alternating path reaches, right ones that one does.
  [[nodiscard]] VertexCover cover() const {
    VertexCover cover;
    std::vector<std::uint8_t> reached(pairs_.rights, 0);
    for (std::int32_t i = 0; i < pairs_.lefts(); ++i) {
      if (layer_[i] == kNone) {
        cover.left.push_back(i);
      } else {
        for (const std::int32_t j : coupled(i)) reached[j] = 1;
      }
    }
    for (std::int32_t j = 0; j < pairs_.rights; ++j) {
      if (reached[j] != 0) cover.right.push_back(j);
    }
    return cover;
  }

 private:
  [[nodiscard]] std::span<const std::int32_t> coupled(std::int32_t i) const {
    return std::span(pairs_.right).subspan(pairs_.start[i], pairs_.start[i + 1] - pairs_.start[i]);
  }

  /// Numbers left vertices by their distance from a single one. Returns whether a single right one is in reach.
  bool find_layers() {
    std::vector<std::int32_t> queue;
    for (std::int32_t i = 0; i < pairs_.lefts(); ++i) {
      layer_[i] = mate_[i] == kNone ? 0 : kNone;
      if (layer_[i] == 0) queue.push_back(i);
    }
    bool found = false;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      const std::int32_t i = queue[head];
      for (const std::int32_t j : coupled(i)) {
        const std::int32_t other = partner_[j];
        if (other == kNone) {
          found = true;
        } else if (layer_[other] == kNone) {
          layer_[other] = layer_[i] + 1;
          queue.push_back(other);
        }
      }
    }
    return found;
  }

  /// Flips one augmenting path from a single left vertex, if the layers hold one.
  void augment(std::int32_t from) {
    path_.assign(1, from);
    while (!path_.empty()) {
      const std::int32_t i = path_.back();
      if (next_[i] == pairs_.start[i + 1]) {  // a dead end
        path_.pop_back();
        if (!path_.empty()) ++next_[path_.back()];
        continue;
      }
      const std::int32_t other = partner_[pairs_.right[next_[i]]];
      if (other == kNone) {
        for (const std::int32_t left : path_) {
          mate_[left] = pairs_.right[next_[left]];
          partner_[mate_[left]] = left;
          next_[left] = pairs_.start[left + 1];  // on no second path of these layers
        }
        return;
      }
      if (layer_[other] == layer_[i] + 1) {
        path_.push_back(other);
      } else {
        ++next_[i];
      }
    }
  }

  const CoupledPairs& pairs_;
  std::vector<std::int32_t> mate_;     // [lefts]
  std::vector<std::int32_t> partner_;  // [rights]
  std::vector<std::int32_t> layer_;    // [lefts] kNone: not reached
  std::vector<std::int32_t> next_;     // [lefts] edge to be tried
  std::vector<std::int32_t> path_;
};

}  // namespace

VertexCover least_vertex_cover(const CoupledPairs& pairs) {
  return Matching(pairs).cover();
}

}  // namespace crackle
