#include "crackle/scene/option_table.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include "crackle/base/error.hpp"
#include "crackle/base/named.hpp"
#include "crackle/base/option_database.hpp"
#include "crackle/base/thread_team.hpp"
#include "crackle/equilibrium/strategies/strategies.hpp"
#include "crackle/network/disorder.hpp"
#include "crackle/network/lattices.hpp"
#include "crackle/record/part.hpp"
#include "crackle/scene/choices.hpp"

namespace crackle {

namespace {

using namespace allow;  // NOLINT(*-using-namespace): the words of the table
using Kind = Allowed::Kind;
using Many = Allowed::Many;
using Words = std::vector<std::string>;

Words with_file(Words words) {
  words.emplace_back("file");
  return words;
}
Words lattices() {
  return with_file(names_of(lattice_kinds()));
}
Words disorders() {
  return with_file(names_of(threshold_laws()));
}
Words stiffnesses() {
  return names_of(stiffness_laws());
}
template <class Table>
std::string meanings_of(const Table& table) {
  std::string text;
  for (const auto& row : table) {
    text.append(text.empty() ? "" : "; ").append(row.name).append(": ").append(row.meaning);
  }
  return text;
}
std::string lattice_meanings() {
  return meanings_of(lattice_kinds());
}
std::string law_meanings() {
  return meanings_of(threshold_laws());
}
std::string stiffness_meanings() {
  return meanings_of(stiffness_laws());
}
std::string part_meanings() {
  std::string text;
  for (const RecordPart* part : record_parts())
    text.append(part->name).append(": ").append(part->meaning).append("; ");
  return text + "network: the network";
}
std::string strategy_meanings() {
  return meanings_of(strategy_kinds());
}
std::string exponents() {
  std::string text;
  for (const ThresholdLaw& law : threshold_laws()) {
    if (law.exponent == nullptr) continue;
    text.append(text.empty() ? "" : ", ").append(law.exponent).append(" of ").append(law.name);
  }
  return text;
}
Words strategies() {
  return names_of(strategy_kinds());
}
Words kernels() {
  return {"auto", "plain", "avx2", "avx512"};
}

constexpr std::array kOptions = {
    Option{"-model", "spring", words(words_of<kModels>), "springs (2 components a node) or fuses (1)", true},
    Option{"-lattice", "triangular", words(lattices), "generated, or read from -lattice_file", true,
           lattice_meanings},
    Option{"-lattice_size", "16", integer(1, kLargestSize, Many::sizes),
           "L: L+1 rows of L+1 nodes; several sizes give a run file each, OUTPUT_L", true},
    Option{"-lattice_row_spacing", "1", number(kLeastRowSpacing, kLargestRowSpacing),
           "height of a row, in lattice spacings along x", true},
    Option{"-lattice_file", "", text("an HDF5 network file"), "the network of -lattice file", true},
    Option{"-grips", "sliding", words(words_of<kGrips>), "x is free, or held, in the gripped rows", true},
    Option{"-break_on", "magnitude", words(words_of<kBreakOns>),
           "the largest |f|/t breaks, or the largest f/t", true},
    Option{"-lattice_dilution", "0", number_below(0, 1), "share of bonds that are missing", true},
    Option{"-stiffness", "uniform", words(stiffnesses), "law of the bonds' stiffnesses", true,
           stiffness_meanings},
    Option{"-stiffness_contrast", "1", number(1, kLargestStiffness), "c of -stiffness", true},
    Option{"-disorder", "uniform", words(disorders),
           "law of the thresholds, r uniform on [0, 1); or the network file's", true, law_meanings},
    Option{"-disorder_exponent", "1", number_above(0), "of -disorder", true, exponents},
    Option{"-disorder_zero_share", "0", number(0, 1), "share of bonds whose threshold is 0", true},
    Option{"-seed", "1", integer(0, kNoBound, Many::each_size),
           "with the sample's number, decides its thresholds", true},
    Option{"-samples", "1", integer(1, kNoBound, Many::each_size), "how many samples to break", false},
    Option{"-first_sample", "0", integer(0, kNoBound, Many::each_size), "number of the first one", false},
    Option{"-ensemble_ranks_per_sample", "1",
           integer(1, kNoBound, Many::one, "that divides the number of processes"),
           "processes that break a sample together, with -equilibrium ksp", true},
    Option{"-checkpoint_every", "60", number(0, kNoBound, "seconds"),
           "an unfinished sample is kept that often, to be continued by -resume", false},
    Option{"-checkpoint_breaks", "0", integer(0),
           "breaks from one chance to keep it to the next; 0: what -equilibrium takes for cheap", true},
    Option{"-stop", "failure",
           text("failure, stiffness=x (0 to 1), breaks=n (from 0) or displacement=d (from 0)"),
           "where a sample ends: nothing carries, F below x of the intact F, n breaks, plate displacement d",
           true},
    Option{"-equilibrium", "tree", words(strategies),
           "what keeps the network in equilibrium while bonds break", true, strategy_meanings},
    Option{"-equilibrium_refactor_every", "1", integer(1),
           "ksp: breaks that one preconditioner serves; an older one leaves more to the iteration", true},
    Option{"-equilibrium_check", "0", integer(0),
           "measure the residual at every so many breaks, refactor above the bound (0: as the strategy "
           "does); of no use to quad, which knows its error",
           false},
    Option{"-equilibrium_check_bound", "1e-12", number_above(0),
           "of -equilibrium_check: largest backward error that is believed", false},
    Option{"-equilibrium_tree_kernels", "auto", words(kernels, "as the processor has them"),
           "instruction set of tree's inner loops (auto: the fastest); decides last bits of loads", true},
    Option{"-equilibrium_tree_precision", "single", words(words_of<kPrecisions>),
           "of tree's search for the next bond (what single leaves open, double decides); decides last bits "
           "of loads",
           true},
    Option{"-equilibrium_tree_threads", "1", integer(1, ThreadTeam::kMost),
           "threads on which tree breaks one sample, in every process: the same bits with any number", false},
    Option{"-equilibrium_tree_verify", "false", flag(),
           "compare every break of tree with a full solve by a fresh factor (slow)", false},
    Option{"-equilibrium_tree_view", "false", flag(), "what tree did, after the summary", false},
    Option{"-output", "crackle.h5", text("the path of a file"), "the run file", false},
    Option{"-resume", "false", flag(), "continue the run that -output holds", false},
    Option{"-overwrite", "false", flag(), "replace what -output holds", false},
    Option{"-record", "breaks", any_words(record_words, "none"),
           "what the run file keeps beside one row a sample", true, part_meanings},
    Option{"-record_profile_height", "", number_above(0),
           "height of a profile's sections (a row; of a network file: the median height of its bonds)", true},
    Option{"-record_snapshot_at", "", text("break numbers from 1, with commas between"),
           "breaks before which displacements and forces are kept", true},
    Option{"-monitor", "auto", words(words_of<kMonitors>),
           "progress: a bar on a terminal, a line a minute elsewhere", false},
};

/// Levenshtein's distance.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// Ours and those that use_options has added.
std::vector<std::span<const Option>>& tables() {
  static std::vector<std::span<const Option>> all{kOptions};
  return all;
}

const Option* find_ours(const std::string& name) {
  for (const auto table : tables()) {
    if (const Option* const option = find_named(table, name)) return option;
  }
  return nullptr;
}

std::string advice(const std::string& name) {
  const Option* closest = kOptions.data();
  for (const auto table : tables()) {
    for (const Option& option : table) {
      if (distance(name, option.name) < distance(name, closest->name)) closest = &option;
    }
  }
  if (closest->name == name) return "an option that this scene uses (it has no use here)";
  std::string known = "one of crackle -help, or an option of the solver in use";
  if (reaches_solver(name)) return known + " (-equilibrium ksp has a KSP)";
  if (distance(name, closest->name) > 3) return known;
  return known + "; did you mean " + closest->name + "?";
}

std::string format_number(double value) {
  std::array<char, 32> digits{};
  std::string text(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
  std::erase(text, '+');  // 1e50
  return text;
}

std::string describe_number(const Allowed& allowed) {
  std::string words = allowed.kind == Kind::integer ? "an integer" : "a number";
  words.append(allowed.above ? " above " : " from ").append(format_number(allowed.least));
  if (allowed.most == kNoBound) return words;
  return words.append(allowed.below ? " to below " : " to ").append(format_number(allowed.most));
}

}  // namespace

std::span<const Option> options() {
  return kOptions;
}

void use_options(std::span<const Option> more) {
  const bool known = std::ranges::any_of(tables(), [&](auto table) { return table.data() == more.data(); });
  if (!known) tables().push_back(more);
}

const Option& find_option(const std::string& name) {
  const Option* const option = find_ours(name);
  assert(option != nullptr);
  return *option;
}

std::string describe(const Allowed& allowed) {
  switch (allowed.kind) {
    case Kind::words: {
      const std::string also = allowed.text;
      return any_of(allowed.words()) + (also.empty() ? "" : ", " + also);
    }
    case Kind::any_words:
      return std::string(allowed.text) + ", or any of " + all_of(allowed.words()) + ", with commas between";
    case Kind::flag:
      return "true or false";
    case Kind::text:
      return allowed.text;
    case Kind::integer:
    case Kind::number:
      break;
  }
  std::string words = describe_number(allowed);
  if (*allowed.text != '\0') words.append(" ").append(allowed.text);
  if (allowed.many == Many::each_size) words += ", or one for each size";
  if (allowed.many == Many::sizes) words += ", or several with commas between";
  return words;
}

std::string allowed_of(const std::string& name) {
  return describe(find_option(name).allowed);
}

bool is_within(const Allowed& allowed, double value) {
  const bool low = allowed.above ? value > allowed.least : value >= allowed.least;
  const bool high = allowed.below ? value < allowed.most : value <= allowed.most;
  return std::isfinite(value) && low && high;
}

std::string meaning_of(const Option& option) {
  return option.meaning + (option.each == nullptr ? "" : " (" + option.each() + ")");
}

std::string format_help() {
  std::string text =
      "crackle breaks disordered spring and fuse lattices bond by bond.\n\n"
      "Options of crackle (default) meaning; allowed values\n";
  for (const auto table : tables()) {
    for (const Option& option : table) {
      std::array<char, 80> start{};
      std::snprintf(start.data(), start.size(), "  %-22s (%s) ", option.name, option.standard);
      text.append(start.data())
          .append(meaning_of(option))
          .append("; ")
          .append(describe(option.allowed))
          .append("\n");
    }
  }
  return text + "\nEvery option of PETSc's KSP and PC is one too. PETSc's own follow.\n";
}

bool decides_results(const std::string& name) {
  if (const Option* own = find_ours(name)) return own->decides;
  return name.find("_view") == std::string::npos && name.find("_monitor") == std::string::npos &&
         name.find("_converged_reason") == std::string::npos;
}

void reject_unused_options() {
  if (const auto unused = unused_option())
    throw InputError(unused->first, unused->second, advice(unused->first));
}

}  // namespace crackle
