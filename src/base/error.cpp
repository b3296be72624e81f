#include "crackle/base/error.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace crackle {

namespace {

/// Bytes of the UTF-8 character that begins at `at`; 0: none does.
std::size_t character_size(const std::string& text, std::size_t at) {
  const auto byte = [&text](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
  };
  const unsigned first = byte(at);
  const std::size_t size = first < 0x80   ? 1
                           : first < 0xc2 ? 0
                           : first < 0xe0 ? 2
                           : first < 0xf0 ? 3
                           : first < 0xf5 ? 4
                                          : 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(at + i) & 0xc0U) != 0x80) return 0;
  }
  const bool control = first < 0x20 || first == 0x7f || (first == 0xc2 && byte(at + 1) < 0xa0);
  return control ? 0 : size;
}

std::string escaped(char byte) {
  if (byte == '\n') return "\\n";
  if (byte == '\t') return "\\t";
  std::array<char, 8> code{};
  std::snprintf(code.data(), code.size(), "\\x%02x", static_cast<unsigned>(static_cast<unsigned char>(byte)));
  return code.data();
}

/// Address space of this process, in bytes.
double bytes_in_use() {
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace

std::string mebibytes(double bytes) {
  constexpr double kMebibyte = 1 << 20;
  return std::to_string(std::llround(bytes / kMebibyte)) + " MiB";
}

std::string explain(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) == nullptr) return error.what();
  std::string text = "out of memory with " + mebibytes(bytes_in_use()) + " in use";
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    text += "; ulimit -v allows " + mebibytes(static_cast<double>(limit.rlim_cur));
  }
  return text;
}

void expect_memory(std::size_t bytes) {
  void* volatile memory = std::malloc(bytes);  // NOLINT(*-no-malloc): a vector's would be left out
  if (memory == nullptr) throw std::bad_alloc();
  std::free(memory);  // NOLINT(*-no-malloc)
}

std::string one_line(const std::string& text, std::size_t most) {
  std::string line;
  for (std::size_t at = 0; at < text.size();) {
    if (line.size() >= most) return line + "... (" + std::to_string(text.size()) + " bytes)";
    const std::size_t size = character_size(text, at);
    line += size == 0 ? escaped(text[at]) : text.substr(at, size);
    at += size == 0 ? 1 : size;
  }
  return line;
}

}  // namespace crackle
