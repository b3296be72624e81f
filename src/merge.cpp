/// Puts runs with other samples of one scene together:
///
///   crackle_merge part_*.h5 -output whole.h5

#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "crackle/base/error.hpp"
#include "crackle/base/interrupt.hpp"
#include "crackle/base/program.hpp"
#include "crackle/record/run_merge.hpp"

namespace {

constexpr const char* kHelp =
    "crackle_merge RUN... -output FILE [-overwrite]\n\n"
    "Writes the samples of all run files into one, ordered by number. They must be of one scene: what "
    "decides\n"
    "results, -seed say, must be the same. A sample that several files have must be the same in all. A run "
    "that\n"
    "was cut short counts with what it has finished.\n";

struct Request {
  std::vector<std::string> runs;
  std::string output;
  bool overwrite = false;
  bool help = false;
};

Request read_request(std::span<char*> words) {
  Request request;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string word = words[i];
    if (word == "-help") {
      request.help = true;
    } else if (word == "-overwrite") {
      request.overwrite = true;
    } else if (word == "-output") {
      if (++i == words.size()) throw crackle::InputError("-output", "without a value", "the path of a file");
      request.output = words[i];
    } else if (word.starts_with("-")) {
      throw crackle::InputError("option", word, "-output FILE, -overwrite or -help");
    } else {
      request.runs.push_back(word);
    }
  }
  if (request.help) return request;
  if (request.runs.empty()) throw crackle::InputError("no run file", "", "one or more, and -output FILE");
  if (request.output.empty()) throw crackle::InputError("-output", "not given", "the path of a file");
  return request;
}

void merge(const Request& request) {
  crackle::ignore_file_size_limit();
  const std::size_t samples = crackle::merge_runs(request.runs, request.output, request.overwrite);
  crackle::tell_what_stays("crackle_merge", request.output);
  std::printf("written: %s, %zu samples\n", request.output.c_str(), samples);
}

}  // namespace

int main(int argc, char** argv) {
  return crackle::run_program("crackle_merge", argc, argv, [&] {
    const Request request = read_request({argv, static_cast<std::size_t>(argc)});
    if (request.help) std::fputs(kHelp, stdout);
    if (!request.help) merge(request);
    return 0;
  });
}
