#include "crackle/record/run_header.hpp"

#include <optional>
#include <set>

namespace crackle {

namespace {

/// "" for one without a value.
std::optional<std::string> find_value(const std::string& text, const std::string& name) {
  const std::string lines = "\n" + text + "\n";
  const std::size_t at = lines.find("\n" + name);
  const std::size_t end = at + 1 + name.size();
  if (at == std::string::npos) return std::nullopt;
  if (lines[end] == '\n') return "";
  if (lines[end] == ' ') return lines.substr(end + 1, lines.find('\n', end) - end - 1);
  return find_value(lines.substr(end), name);  // another that begins so
}

}  // namespace

std::string option_value(const std::string& options, const std::string& name) {
  return find_value(options, name).value_or("");
}

std::string differing_options(const RunHeader& ours, const RunHeader& theirs) {
  std::set<std::string> names(ours.deciding.begin(), ours.deciding.end());
  names.insert(theirs.deciding.begin(), theirs.deciding.end());
  std::string result;
  for (const std::string& name : names) {
    const auto mine = find_value(ours.options, name);
    const auto other = find_value(theirs.options, name);
    if (mine == other) continue;
    if (!result.empty()) result += ", ";
    result.append(name).append(" ").append(mine.value_or("not given"));
    result.append(" (the file has ").append(other.value_or("none")).append(")");
  }
  return result;
}

}  // namespace crackle
