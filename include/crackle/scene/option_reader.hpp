/// Our options in PETSc's database, one after the other: value or default, whether it is allowed, and what was used.
///
/// Everything throws InputError, naming the option, its value and what is allowed (option_table).
#pragma once

#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "crackle/base/error.hpp"
#include "crackle/base/named.hpp"
#include "crackle/base/option_database.hpp"
#include "crackle/scene/option_table.hpp"

namespace crackle {

/// Of options that list a value for each size of the run, it takes that of one size.
class Reader {
 public:
  explicit Reader(std::size_t part = 0, std::size_t parts = 1) : part_(part), parts_(parts) {}

  /// Of one value for all sizes, or one for each, that of this size.
  template <class Number>
  Number listed_number(const char* name) {
    const std::string list = text(name);
    const std::vector<std::string> values = split(list);
    if (list.ends_with(',') || (values.size() != 1 && values.size() != parts_)) {
      throw InputError(
          name, list,
          allowed_of(name) + "; as many as -lattice_size has (" + std::to_string(parts_) + "), or one");
    }
    used_[name] = values.size() == 1 ? values.front() : values[part_];
    return parse<Number>(name, list, used_[name]);
  }

  [[nodiscard]] const std::map<std::string, std::string>& used() const { return used_; }
  [[nodiscard]] std::size_t parts() const { return parts_; }

  [[nodiscard]] static bool given(const char* name) { return is_given(name); }

  std::string text(const char* name);

  /// Notes a value that follows from other options.
  std::string note(const char* name, const std::string& value) { return used_[name] = value; }

  /// The row of a table that the value names.
  template <class Table>
  const auto& choice(const char* name, const Table& table) {
    const std::string value = text(name);
    const auto* const row = find_named(table, value);
    if (row == nullptr) throw InputError(name, value, allowed_of(name));
    return *row;
  }

  template <class Number>
  Number number(const char* name) {
    const std::string value = text(name);
    return parse<Number>(name, value, value);
  }

  bool flag(const char* name);

  /// `digits` as a number within the option's bounds; `value` is what a message shows.
  template <class Number>
  static Number parse(const char* name, const std::string& value, const std::string& digits) {
    const auto number = parse_within<Number>(digits, find_option(name).allowed);
    if (!number) throw InputError(name, value, allowed_of(name));
    return *number;
  }

  /// Nothing for what is no number, or out of bounds.
  template <class Number>
  static std::optional<Number> parse_within(const std::string& digits, const Allowed& bounds) {
    Number result{};
    const char* const end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, result);
    if (error != std::errc{} || stop != end || !is_within(bounds, static_cast<double>(result)))
      return std::nullopt;
    return result;
  }

 private:
  std::size_t part_;
  std::size_t parts_;
  std::map<std::string, std::string> used_;
};

}  // namespace crackle
