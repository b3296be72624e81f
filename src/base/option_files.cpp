#include "crackle/base/option_files.hpp"

#include <petscsys.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "crackle/base/error.hpp"
#include "crackle/base/option_database.hpp"
#include "crackle/base/petsc_handle.hpp"

namespace crackle {

namespace {

constexpr const char* kLine =
    "one option a line: -name value, or -name; a value with spaces between \"\", comments after a space and "
    "#";

constexpr int kMostFiles = 500;          // each is read within the one that includes it: the stack has an end
constexpr std::size_t kMostNames = 500;  // PETSc's table has 512 places, some of which it fills itself
constexpr int kMostAliases = 25;         // PETSc's limit

std::string lower(std::string word) {
  std::ranges::transform(word, word.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word;
}

/// A word of a line, and whether it stood between quotes.
struct Word {
  std::string text;
  bool quoted = false;
};

/// Walks through all that PETSc would take, files within files.
class Walk {
 public:
  std::vector<GivenOption> found;
  bool on_command_line = false;  ///< what comes now is of the command line

  /// `asked`: who names the file, for a message.
  void file(const std::string& name, const std::string& asked);

  void petscrc() {
    if (const char* home = std::getenv("HOME")) optional_file(std::string(home) + "/.petscrc");
    optional_file(".petscrc");
    optional_file("petscrc");
  }

  /// Words of which every other one may be a value.
  void words(const std::vector<std::string>& list, const std::string& place, bool strict);

 private:
  void optional_file(const std::string& name) {
    if (std::filesystem::is_regular_file(name)) file(name, name);
  }

  void line(const std::string& text, const std::string& place);
  void take(const std::string& name, const std::string& value, const std::string& place);

  int files_ = 0;
  int aliases_ = 0;
  std::vector<std::filesystem::path>
      open_;  ///< the files that are being read, each included by the one before
};

bool is_yaml(const std::string& name) {
  return name.ends_with(".yml") || name.ends_with(".yaml");
}

/// PETSc replaces ${...} in a name: such a file is left to it. It reads a file twice: of a pipe nothing would be left.
bool can_look(const std::string& name, const std::string& asked) {
  if (name.find("${") != std::string::npos) return false;
  std::error_code error;
  const auto status = std::filesystem::status(name, error);
  const bool strange = std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
  if (!strange || name == "/dev/null") return true;
  const bool folder = std::filesystem::is_directory(status);
  throw InputError(asked, name,
                   std::string("an options file, not ") + (folder ? "a folder" : "a pipe or device"));
}

/// The whole text of a file of options.
std::string read_text(const std::string& name, const std::string& asked) {
  const std::string allowed = "an options file that can be read";
  std::ifstream stream(name, std::ios::binary);
  if (!stream) throw InputError(asked, name, allowed + ": " + std::strerror(errno));
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::string what = "options file " + name;
  if (text.starts_with("\xef\xbb\xbf")) throw InputError(what, "", "a text without a byte order mark");
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    throw InputError(what, "", "a text in ASCII or UTF-8, not in UTF-16");
  }
  if (text.find('\0') != std::string::npos) throw InputError(what, "", "a text: it has bytes that are 0");
  return text;
}

/// What a # cuts off, without a space before it, might have been meant.
std::string without_comment(const std::string& text, const std::string& place) {
  const std::size_t at = text.find('#');
  if (at == std::string::npos) return text;
  const bool doubtful = at > 0 && text[at - 1] != ' ' && at + 1 < text.size() && text[at + 1] != ' ';
  if (doubtful) throw InputError(place + ":", text, kLine);
  return text.substr(0, at);
}

std::vector<Word> words_of(const std::string& text, const std::string& place) {
  std::vector<Word> words;
  for (std::size_t at = text.find_first_not_of(' '); at < text.size(); at = text.find_first_not_of(' ', at)) {
    const bool quoted = text[at] == '"';
    const std::size_t begin = quoted ? at + 1 : at;
    const std::size_t end = quoted ? text.find('"', begin) : std::min(text.find(' ', begin), text.size());
    if (end == std::string::npos)
      throw InputError(place + ":", text, "a quote that is closed on the same line");
    const std::string word = text.substr(begin, end - begin);
    const bool joined = quoted && end + 1 < text.size() && text[end + 1] != ' ';
    if (joined || word.find('"') != std::string::npos) {
      throw InputError(place + ":", text, "quotes around a whole value");
    }
    words.push_back({word, quoted});
    at = quoted ? end + 1 : end;
  }
  return words;
}

void Walk::file(const std::string& name, const std::string& asked) {
  if (!can_look(name, asked)) return;
  const std::string text = read_text(name, asked);
  if (is_yaml(name)) return;
  const std::filesystem::path whole = std::filesystem::weakly_canonical(name);
  if (std::ranges::find(open_, whole) != open_.end()) {
    throw InputError(asked, name, "an options file that doesn't include itself");
  }
  if (++files_ > kMostFiles) {
    throw InputError(asked, name,
                     "at most " + std::to_string(kMostFiles) + " options files, includes among them");
  }
  open_.push_back(whole);
  std::istringstream lines(text);
  int number = 0;
  for (std::string one; std::getline(lines, one);) {
    std::ranges::replace_if(
        one, [](char c) { return c == '\t' || c == '\r'; }, ' ');
    line(one, "options file " + name + ", line " + std::to_string(++number));
  }
  open_.pop_back();
}

void Walk::line(const std::string& text, const std::string& place) {
  const std::vector<Word> words = words_of(without_comment(text, place), place);
  if (words.empty()) return;
  const bool alias = lower(words[0].text) == "alias" && words.size() == 3;
  if (alias && looks_like_option(words[1].text) && looks_like_option(words[2].text)) {
    if (++aliases_ > kMostAliases) {
      throw InputError(place + ":", text, "at most " + std::to_string(kMostAliases) + " aliases");
    }
    take(words[1].text, "", place);
    return;
  }
  const bool one_option = looks_like_option(words[0].text) && words.size() <= 2 &&
                          (words.size() == 1 || !looks_like_option(words[1].text));
  if (!one_option) throw InputError(place + ":", text, kLine);
  take(words[0].text, words.size() == 2 ? words[1].text : "", place);
}

void Walk::take(const std::string& name, const std::string& value, const std::string& place) {
  found.push_back({lower(name), value, place, on_command_line});
  const std::string asked = (place.empty() ? "" : place + ": ") + name;
  const bool includes = found.back().name == "-options_file" || found.back().name == "-options_file_yaml";
  if (!includes) return;
  if (value.empty()) throw InputError(asked, "without a value", "an options file that can be read");
  if (found.back().name == "-options_file") {
    file(value, asked);
  } else if (can_look(value, asked)) {
    (void)read_text(value, asked);
  }
}

void Walk::words(const std::vector<std::string>& list, const std::string& place, bool strict) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (looks_like_option(list[i])) {
      const bool has_value = i + 1 < list.size() && !looks_like_option(list[i + 1]);
      take(list[i], has_value ? list[i + 1] : "", place);
      if (has_value) ++i;
    } else if (strict) {
      throw InputError(place + ":", list[i], "options that begin with -, each with one value");
    }
  }
}

std::vector<std::string> texts_of(const std::vector<Word>& words) {
  std::vector<std::string> texts;
  texts.reserve(words.size());
  for (const Word& word : words) texts.push_back(word.text);
  return texts;
}

}  // namespace

std::vector<GivenOption> given_options(int argc, char* const* argv) {
  const std::vector<std::string> line(argv + std::min(argc, 1), argv + argc);
  Walk walk;
  if (std::ranges::find(line, "-skip_petscrc") == line.end()) walk.petscrc();
  if (const char* more = std::getenv("PETSC_OPTIONS")) {
    std::string text = more;
    std::ranges::replace_if(
        text, [](unsigned char c) { return std::isspace(c) != 0; }, ' ');
    walk.words(texts_of(words_of(text, "PETSC_OPTIONS")), "PETSC_OPTIONS", true);
  }
  walk.on_command_line = true;
  walk.words(line, "", false);  // see reject_stray_words
  return std::move(walk.found);
}

std::vector<GivenOption> options_in_file(const std::string& file) {
  Walk walk;
  walk.file(file, "options file");
  return std::move(walk.found);
}

std::vector<GivenOption> given_options() {
  int count = 0;
  char** words = nullptr;
  petsc::check(PetscGetArgs(&count, &words));
  return given_options(count, words);
}

void check_options(int argc, char* const* argv) {
  for (const char* const rank : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"}) {
    const char* const number = std::getenv(rank);
    if (number != nullptr && std::string(number) != "0") return;
  }
  std::set<std::string> names;
  for (const GivenOption& option : given_options(argc, argv)) {
    names.insert(option.name);
    if (names.size() <= kMostNames) continue;
    throw InputError((option.place.empty() ? "" : option.place + ": ") + option.name, option.value,
                     "at most " + std::to_string(kMostNames) + " different options");
  }
}

namespace {

/// Where an option stands that PETSc has and that isn't among those looked through; empty when there is no YAML.
std::string yaml_place(const std::string& name, const std::vector<GivenOption>& given) {
  PetscBool set = PETSC_FALSE;
  petsc::check(PetscOptionsHasName(nullptr, nullptr, name.c_str(), &set));
  if (set != PETSC_TRUE) return "";
  std::string place;
  if (std::getenv("PETSC_OPTIONS_YAML") != nullptr) place = "PETSC_OPTIONS_YAML";
  for (const GivenOption& option : given) {
    const bool yaml =
        option.name == "-options_file_yaml" || (option.name == "-options_file" && is_yaml(option.value));
    if (yaml) place += (place.empty() ? "options file " : " or options file ") + option.value;
  }
  return place;
}

}  // namespace

std::runtime_error with_place(const std::exception& error) {
  const std::string message = explain(error);
  const std::string name = lower(message.substr(0, message.find_first_of(" :")));
  if (!looks_like_option(name)) return std::runtime_error(message);
  const std::vector<GivenOption> given = given_options();
  const auto last = std::find_if(given.rbegin(), given.rend(),
                                 [&name](const GivenOption& option) { return option.name == name; });
  const std::string place = last == given.rend() ? yaml_place(name, given) : last->place;
  return std::runtime_error(place.empty() ? message : message + " (it stands in " + place + ")");
}

}  // namespace crackle
