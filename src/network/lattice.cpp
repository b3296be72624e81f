#include "crackle/network/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>

#include "crackle/base/error.hpp"

namespace crackle {

namespace {

/// The shortest vector between two nodes, over the images of the second one.
Vector2 nearest_image(Vector2 from, Vector2 to, double period_x) {
  double dx = to.x - from.x;
  if (period_x > 0) {
    dx -= period_x * std::round(dx / period_x);
    if (dx == -period_x / 2) dx = period_x / 2;
  }
  return {dx, to.y - from.y};
}

std::string format_number(double value) {
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), "%.6g", value);
  return digits.data();
}

std::string format_vector(Vector2 v) {
  return "(" + format_number(v.x) + ", " + format_number(v.y) + ")";
}

void check_nodes(const Lattice& lattice) {
  if (!(lattice.period_x >= 0) || std::isinf(lattice.period_x)) {
    throw InputError("period_x", format_number(lattice.period_x), "0 (not periodic) or a positive length");
  }
  if (lattice.position.size() != lattice.grip.size()) {
    throw InputError("number of grip marks", std::to_string(lattice.grip.size()),
                     "one for each of the " + std::to_string(lattice.position.size()) + " nodes");
  }
  for (NodeId node = 0; node < lattice.nodes(); ++node) {
    const Vector2 p = lattice.position[node];
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      throw InputError("position of node " + std::to_string(node), "", "two finite numbers");
    }
    const int mark = static_cast<int>(lattice.grip[node]);
    if (mark < 0 || mark > 2) {
      throw InputError("grip of node " + std::to_string(node), std::to_string(mark),
                       "0 (free), 1 (bottom) or 2 (top)");
    }
  }
  for (const auto& [mark, name] : {std::pair{Grip::bottom, "bottom (1)"}, std::pair{Grip::top, "top (2)"}}) {
    if (std::ranges::find(lattice.grip, mark) == lattice.grip.end()) {
      throw InputError("grip", "", std::string("at least one node marked ") + name);
    }
  }
}

std::string nodes_of(const Lattice& lattice, BondId e) {
  const auto [a, b] = lattice.bond[e];
  return " of bond " + std::to_string(e) + " (nodes " + std::to_string(a) + ", " + std::to_string(b) + ")";
}

/// What rounding can have done to the difference of two coordinates.
double rounding_of(double a, double b, double period = 0) {
  return 4 * std::numeric_limits<double>::epsilon() * std::max({std::abs(a), std::abs(b), period});
}

double rounding_of_x(const Lattice& lattice, BondId e) {
  const auto [a, b] = lattice.bond[e];
  return rounding_of(lattice.position[a].x, lattice.position[b].x, lattice.period_x);
}

void check_step(const Lattice& lattice, BondId e) {
  const Vector2 step = lattice.step[e];
  if (!std::isfinite(step.x) || !std::isfinite(step.y))
    throw InputError("step" + nodes_of(lattice, e), "", "two finite numbers");
  const auto [a, b] = lattice.bond[e];
  const double period = lattice.period_x;
  double dx = lattice.position[b].x - lattice.position[a].x - step.x;
  if (period > 0) dx -= period * std::round(dx / period);
  const double dy = lattice.position[b].y - lattice.position[a].y - step.y;
  const double allowed = kStepTolerance * std::hypot(step.x, step.y);
  const double rounding_y = rounding_of(lattice.position[a].y, lattice.position[b].y);
  if (std::abs(dx) <= allowed + rounding_of_x(lattice, e) && std::abs(dy) <= allowed + rounding_y) return;
  throw InputError(
      "step" + nodes_of(lattice, e), format_vector(step),
      "the way from its first node to the second or, in x, to one of its images: what is left is " +
          format_vector({dx, dy}));
}

/// The way from a bond's first node to its second.
Vector2 step_of(const Lattice& lattice, BondId e) {
  if (!lattice.step.empty()) return lattice.step[e];
  const auto [a, b] = lattice.bond[e];
  return nearest_image(lattice.position[a], lattice.position[b], lattice.period_x);
}

}  // namespace

Lattice make_lattice(double period_x, std::vector<Vector2> position, std::vector<Grip> grip,
                     std::vector<std::array<NodeId, 2>> bond, std::vector<Vector2> step) {
  Lattice lattice{period_x, std::move(position), std::move(grip), std::move(bond), {}, std::move(step)};
  check_nodes(lattice);
  if (!lattice.step.empty() && lattice.step.size() != lattice.bond.size()) {
    throw InputError("number of steps", std::to_string(lattice.step.size()),
                     "one for each of the " + std::to_string(lattice.bonds()) + " bonds");
  }
  lattice.direction.reserve(lattice.bond.size());
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    const std::string name = "bond " + std::to_string(e);
    for (const NodeId node : lattice.bond[e]) {
      if (node < 0 || node >= lattice.nodes()) {
        throw InputError("node " + std::to_string(node) + " of " + name, "",
                         "0 to " + std::to_string(lattice.nodes() - 1));
      }
    }
    const auto [a, b] = lattice.bond[e];
    if (a == b) throw InputError(name, "", "a bond between two different nodes");
    if (!lattice.step.empty()) check_step(lattice, e);
    const Vector2 d = step_of(lattice, e);
    const double length = std::hypot(d.x, d.y);
    if (!(length >= std::numeric_limits<double>::min()) || std::isinf(length)) {
      throw InputError("length of " + name, format_number(length),
                       "a positive number (from 2.3e-308 to 1.7e308)");
    }
    lattice.direction.push_back({d.x / length, d.y / length});
  }
  return lattice;
}

void check_directions(const Lattice& lattice) {
  for (BondId e = 0; e < lattice.bonds(); ++e) {
    const Vector2 d = lattice.direction[e];
    for (const double part : {std::abs(d.x), std::abs(d.y)}) {
      if (part == 0 || part >= kLeastRowSpacing) continue;
      throw InputError(
          "direction" + nodes_of(lattice, e), format_vector(d),
          "two components that are 0 or from " + format_number(kLeastRowSpacing) + " of the length");
    }
    if (lattice.period_x == 0 || !lattice.step.empty()) continue;
    const double half = lattice.period_x / 2;
    const double left = half - std::abs(step_of(lattice, e).x);
    if (left > kStepTolerance * half + rounding_of_x(lattice, e)) continue;
    throw InputError(
        "bond " + std::to_string(e) + " (nodes " + std::to_string(lattice.bond[e][0]) + ", " +
            std::to_string(lattice.bond[e][1]) + "), half a period of " + format_number(lattice.period_x) +
            " long in x",
        "",
        "a bond with one nearest image of its second node, or a dataset /network/bonds/step that "
        "gives every bond's way from its first node to its second");
  }
}

}  // namespace crackle
