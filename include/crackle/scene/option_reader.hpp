/// Our options in PETSc's database, one after the other: value or default, whether it is allowed, and what was used.
///
/// Everything throws InputError, naming the option, its value and what is allowed (option_text).
#pragma once

#include <charconv>
#include <cmath>
#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "crackle/base/error.hpp"
#include "crackle/scene/option_text.hpp"

namespace crackle {

/// What stands between the commas.
[[nodiscard]] std::vector<std::string> split(const std::string& list);

/// Of options that list a value for each size of the run, it takes that of one size.
class Reader {
 public:
  explicit Reader(std::size_t part = 0, std::size_t parts = 1) : part_(part), parts_(parts) {}

  /// Of one value for all sizes, or one for each, that of this size.
  template <class Number>
  Number listed_number(const char* name, Number least) {
    const std::string list = text(name);
    const std::vector<std::string> values = split(list);
    if (list.ends_with(',') || (values.size() != 1 && values.size() != parts_)) {
      throw InputError(name, list,
                       std::string(find_option(name).allowed) + "; as many as -lattice_size has (" +
                           std::to_string(parts_) + "), or one");
    }
    used_[name] = values.size() == 1 ? values.front() : values[part_];
    return parse(name, list, used_[name], least);
  }

  [[nodiscard]] const std::map<std::string, std::string>& used() const { return used_; }
  [[nodiscard]] std::size_t parts() const { return parts_; }

  [[nodiscard]] bool given(const char* name) const;

  std::string text(const char* name);

  /// Notes a value that follows from other options.
  std::string note(const char* name, const std::string& value) { return used_[name] = value; }

  /// The place of the value among the words allowed.
  template <class Choice>
  Choice choice(const char* name, std::initializer_list<std::pair<const char*, Choice>> choices) {
    const std::string value = text(name);
    for (const auto& [word, meaning] : choices) {
      if (value == word) return meaning;
    }
    throw InputError(name, value, find_option(name).allowed);
  }

  template <class Number>
  Number number(const char* name, Number least) {
    const std::string value = text(name);
    return parse(name, value, value, least);
  }

  /// A positive, finite number.
  double positive(const char* name);

  bool flag(const char* name);

  /// `digits` as a number from `least` on; `value` is what a message shows.
  template <class Number>
  static Number parse(const char* name, const std::string& value, const std::string& digits, Number least) {
    Number result{};
    const char* const end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, result);
    if (error != std::errc{} || stop != end || !(result >= least) ||
        !std::isfinite(static_cast<double>(result))) {
      throw InputError(name, value, find_option(name).allowed);
    }
    return result;
  }

 private:
  std::size_t part_;
  std::size_t parts_;
  std::map<std::string, std::string> used_;
};

}  // namespace crackle
