/// Rows of a table that have a name.
#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace crackle {

/// The row of that name; null: none has it.
template <class Table>
[[nodiscard]] auto find_named(const Table& table, std::string_view name) {
  const auto row =
      std::ranges::find(table, name, [](const auto& each) { return std::string_view(each.name); });
  return row == std::ranges::end(table) ? nullptr : &*row;
}

template <class Table>
[[nodiscard]] std::vector<std::string> names_of(const Table& table) {
  std::vector<std::string> names;
  names.reserve(std::size(table));
  for (const auto& row : table) names.emplace_back(row.name);
  return names;
}

/// "a", "a or b", "a, b or c".
[[nodiscard]] inline std::string any_of(std::span<const std::string> words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

/// "a, b, c".
[[nodiscard]] inline std::string all_of(std::span<const std::string> words) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(word);
  return text;
}

}  // namespace crackle
