#include "crackle/equilibrium/tree/cut_patterns.hpp"

#include <algorithm>
#include <utility>

namespace crackle {

namespace {

constexpr std::int32_t kOutside = -1;
constexpr std::int32_t kEndOfRow = -1;
constexpr std::size_t kNumbersPerUnknown = 12;  // of the triangular lattice with springs, about

}  // namespace

/// FNV-1a, a number at a time.
std::size_t CutPatterns::Hash::operator()(const Shape& shape) const {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const std::int32_t number : shape) {
    hash = (hash ^ static_cast<std::uint32_t>(number)) * 0x100000001b3;
    hash ^= hash >> 32;
  }
  return hash;
}

CutPatterns::CutPatterns(const UnknownGraph& graph, std::span<const Place> place)
    : graph_(graph), place_(place), local_(graph.unknowns(), kOutside) {}

CutPatterns::Shape CutPatterns::shape_of(std::span<const Dof> region, std::span<const Dof> around) {
  Shape shape;
  shape.reserve(kNumbersPerUnknown * region.size());
  for (std::size_t k = 0; k < region.size(); ++k) local_[region[k]] = static_cast<std::int32_t>(k);
  for (const Dof i : region) {
    const Place place = place_[i];
    shape.push_back(place.x - place_[region[0]].x);
    shape.push_back(place.y - place_[region[0]].y);
    add_row(i, local_[i], shape);
  }
  touching_.assign(around.begin(), around.end());
  std::ranges::sort(touching_);
  for (const Dof outside : touching_) {
    const std::size_t before = shape.size();
    add_row(outside, kOutside, shape);
    if (shape.size() == before + 1) shape.pop_back();  // it touches nothing
  }
  for (const Dof i : region) local_[i] = kOutside;
  return shape;
}

/// The unknowns of the region that i is coupled with and that come after number `after`.
void CutPatterns::add_row(Dof i, std::int32_t after, Shape& shape) const {
  for (const Dof other : graph_.neighbours(i)) {
    if (local_[other] > after) shape.push_back(local_[other]);
  }
  shape.push_back(kEndOfRow);
}

const CutPattern* CutPatterns::find(const Shape& shape) const {
  const auto found = pattern_.find(shape);
  return found == pattern_.end() ? nullptr : &found->second;
}

void CutPatterns::keep(Shape shape, CutPattern pattern) {
  pattern_.emplace(std::move(shape), std::move(pattern));
}

}  // namespace crackle
