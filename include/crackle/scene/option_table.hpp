/// Our options: one table. What -help says, what a refusal allows, what a run file keeps as deciding follow from it.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/named.hpp"

namespace crackle {

/// Largest L of a generated lattice: its 3L^2 bonds and 4L^2 entries of b_e are counted in 32 bits.
inline constexpr int kLargestSize = 8192;

/// What an option's value may be.
struct Allowed {
  enum class Kind : std::uint8_t { words, any_words, integer, number, flag, text };
  enum class Many : std::uint8_t { one, each_size, sizes };  ///< a value; or one for each size; several sizes

  Kind kind = Kind::text;
  double least = 0;
  double most = std::numeric_limits<double>::infinity();
  bool above = false;  ///< `least` itself is not allowed
  bool below = false;  ///< nor is `most`
  Many many = Many::one;
  std::vector<std::string> (*words)() = nullptr;
  const char* text = "";  ///< of text: what it is; of others: what else there is to say
};

inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

/// How a row of the table says it.
namespace allow {

constexpr Allowed integer(double least, double most = kNoBound, Allowed::Many many = Allowed::Many::one,
                          const char* also = "") {
  return {.kind = Allowed::Kind::integer, .least = least, .most = most, .many = many, .text = also};
}
constexpr Allowed number(double least, double most = kNoBound, const char* also = "") {
  return {.kind = Allowed::Kind::number, .least = least, .most = most, .text = also};
}
constexpr Allowed number_above(double least) {
  return {.kind = Allowed::Kind::number, .least = least, .above = true};
}
constexpr Allowed number_below(double least, double most) {
  return {.kind = Allowed::Kind::number, .least = least, .most = most, .below = true};
}
constexpr Allowed text(const char* what) {
  return {.kind = Allowed::Kind::text, .text = what};
}
constexpr Allowed words(std::vector<std::string> (*list)(), const char* also = "") {
  return {.kind = Allowed::Kind::words, .words = list, .text = also};
}
/// A list of these, or `none`.
constexpr Allowed any_words(std::vector<std::string> (*list)(), const char* none) {
  return {.kind = Allowed::Kind::any_words, .words = list, .text = none};
}
constexpr Allowed flag() {
  return {.kind = Allowed::Kind::flag};
}
/// The names of a table's rows.
template <const auto& table>
std::vector<std::string> words_of() {
  return names_of(table);
}

}  // namespace allow

struct Option {
  const char* name;      ///< "-lattice_size"
  const char* standard;  ///< default, as one would type it; "" for none
  Allowed allowed;
  const char* meaning;              ///< one line
  bool decides;                     ///< another value gives other results
  std::string (*each)() = nullptr;  ///< what the words mean, from their own table
};

/// Those of every program, in the order of -help.
[[nodiscard]] std::span<const Option> options();

/// Another program's own join them, for the rest of the run.
void use_options(std::span<const Option> more);

/// The option of that name; it must be one of ours.
[[nodiscard]] const Option& find_option(const std::string& name);

/// "an integer from 1 to 8192", "spring or fuse".
[[nodiscard]] std::string describe(const Allowed& allowed);
/// The same of the option of that name.
[[nodiscard]] std::string allowed_of(const std::string& name);

/// Whether a number is within the option's bounds; a NaN isn't.
[[nodiscard]] bool is_within(const Allowed& allowed, double value);

/// `meaning`, and what each word means.
[[nodiscard]] std::string meaning_of(const Option& option);

/// The text of -help.
[[nodiscard]] std::string format_help();

/// True for our options that decide what a run file holds, and for the solver's but for those that only look.
[[nodiscard]] bool decides_results(const std::string& name);

/// Throws InputError for the first option that nobody has asked for: misspelt, or of no use in this scene.
/// Call it once the solver has read its own.
void reject_unused_options();

}  // namespace crackle
