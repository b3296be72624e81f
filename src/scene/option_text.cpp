#include "crackle/scene/option_text.hpp"

#include <petscsys.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <map>
#include <numeric>
#include <sstream>
#include <vector>

#include "crackle/base/error.hpp"
#include "crackle/base/petsc_handle.hpp"

namespace crackle {

namespace {

constexpr std::array kOptions = {
    OptionText{"-model", "spring", "spring or fuse", "springs (2 components a node) or fuses (1)", true},
    OptionText{"-lattice", "triangular", "triangular or file", "generated, or read from -lattice_file", true},
    OptionText{"-lattice_size", "16", "an integer from 1 to 8192, or several with commas between",
               "L: L+1 rows of L+1 nodes; several sizes give a run file each, OUTPUT_L", true},
    OptionText{"-lattice_row_spacing", "1", "a number above 0, from 1e-50 to 1e50",
               "height of a row, in lattice spacings along x", true},
    OptionText{"-lattice_file", "", "an HDF5 network file", "the network of -lattice file", true},
    OptionText{"-grips", "sliding", "sliding or clamped", "x is free, or held, in the gripped rows", true},
    OptionText{"-break_on", "magnitude", "magnitude or tension",
               "the largest |f|/t breaks, or the largest f/t", true},
    OptionText{"-lattice_dilution", "0", "a number from 0 to below 1", "share of bonds that are missing",
               true},
    OptionText{"-stiffness", "uniform", "uniform, random, inclusion or band",
               "bonds: all 1; log-uniform from 1/c to 1; a disc of c in the middle; a band of 1/c", true},
    OptionText{"-stiffness_contrast", "1", "a number from 1 to 1e100", "c of -stiffness", true},
    OptionText{"-disorder", "uniform", "uniform, power, constant or file",
               "thresholds: r uniform on [0, 1), r^D, 1, or the network file's", true},
    OptionText{"-disorder_exponent", "1", "a number above 0", "D of -disorder power", true},
    OptionText{"-disorder_zero_share", "0", "a number from 0 to 1", "share of bonds whose threshold is 0",
               true},
    OptionText{"-seed", "1", "an integer from 0, or one for each size",
               "with the sample's number, decides its thresholds", true},
    OptionText{"-samples", "1", "an integer from 1, or one for each size", "how many samples to break",
               false},
    OptionText{"-first_sample", "0", "an integer from 0, or one for each size", "number of the first one",
               false},
    OptionText{"-ensemble_ranks_per_sample", "1", "an integer from 1 that divides the number of processes",
               "processes that break a sample together, with -equilibrium ksp", true},
    OptionText{"-checkpoint_every", "60", "seconds, from 0",
               "an unfinished sample is kept that often, to be continued by -resume", false},
    OptionText{"-checkpoint_breaks", "0", "an integer from 0",
               "breaks from one chance to keep it to the next; 0: what -equilibrium takes for cheap", true},
    OptionText{
        "-stop", "failure", "failure, stiffness=x (0 to 1), breaks=n (from 0) or displacement=d (from 0)",
        "where a sample ends: nothing carries, F below x of the intact F, n breaks, plate displacement d",
        true},
    OptionText{"-equilibrium", "tree", "tree, ksp, dense or quad",
               "strategy: a factor on a separator tree; a PETSc KSP (the default when a -ksp_ or -pc_ option "
               "is given); LAPACK; a factor in 113 bits, where stiffnesses are too far apart for the others",
               true},
    OptionText{"-equilibrium_refactor_every", "1", "an integer from 1",
               "ksp: breaks that one preconditioner serves; an older one leaves more to the iteration", true},
    OptionText{
        "-equilibrium_check", "0", "an integer from 0",
        "measure the residual at every so many breaks, refactor above the bound (0: as the strategy does)",
        false},
    OptionText{"-equilibrium_check_bound", "1e-12", "a number above 0",
               "of -equilibrium_check: largest backward error that is believed", false},
    OptionText{"-equilibrium_tree_kernels", "auto", "auto, plain, avx2 or avx512, as the processor has them",
               "instruction set of tree's inner loops (auto: the fastest); decides last bits of loads", true},
    OptionText{"-equilibrium_tree_verify", "false", "true or false",
               "compare every break of tree with a full solve by a fresh factor (slow)", false},
    OptionText{"-equilibrium_tree_view", "false", "true or false", "what tree did, after the summary", false},
    OptionText{"-output", "crackle.h5", "the path of a file", "the run file", false},
    OptionText{"-resume", "false", "true or false", "continue the run that -output holds", false},
    OptionText{"-overwrite", "false", "true or false", "replace what -output holds", false},
    OptionText{"-record", "breaks", "none, or any of breaks, profile, snapshot, network, with commas between",
               "what the run file keeps beside one row a sample", true},
    OptionText{"-record_profile_height", "", "a number above 0",
               "height of a profile's sections (a row; of a network file: the median height of its bonds)",
               true},
    OptionText{"-record_snapshot_at", "", "break numbers from 1, with commas between",
               "breaks before which displacements and forces are kept", true},
    OptionText{"-compare", "", "files of solver options, with commas between",
               "the strategies (options/solver_*.opts)", false},
    OptionText{"-compare_rtol", "", "numbers between 0 and 1, with commas between",
               "tolerances to run each iteration with", false},
    OptionText{"-compare_every", "10", "an integer from 1", "measure at every so many breaks", false},
    OptionText{"-compare_repetitions", "3", "an integer from 1", "how often each strategy runs", false},
    OptionText{"-compare_skip", "0", "an integer from 0",
               "first breaks that are taken from tree, and not compared", false},
    OptionText{"-compare_along", "reference", "reference or own",
               "whose breaks damage the network that a strategy solves", false},
    OptionText{"-compare_reference", "auto", "auto, quad or refined",
               "113-bit factors (auto: where small), or refinement in long double", false},
    OptionText{"-monitor", "auto", "auto or none", "progress: a bar on a terminal, a line a minute elsewhere",
               false},
};

/// Files written before this option was there don't say what they were broken with.
constexpr const char* kSinceLater = "-equilibrium_tree_kernels";

/// PETSc looks at these in its first solve, when it ends, or never where they are already obeyed.
constexpr std::array kLateOptions = {"ksp_converged_reason",
                                     "ksp_converged_rate",
                                     "options_left",
                                     "options_view",
                                     "options_monitor",
                                     "objects_dump",
                                     "malloc",
                                     "malloc_debug",
                                     "malloc_dump",
                                     "malloc_view",
                                     "malloc_view_threshold",
                                     "malloc_test",
                                     "memory_view",
                                     "log_view",
                                     "log_view_memory",
                                     "log_view_gpu_time",
                                     "log_all",
                                     "log",
                                     "log_exclude",
                                     "log_sync",
                                     "log_trace",
                                     "info",
                                     "info_exclude",
                                     "history",
                                     "get_total_flops",
                                     "check_stack",
                                     "on_error_abort",
                                     "on_error_mpiabort",
                                     "on_error_attach_debugger",
                                     "start_in_debugger",
                                     "debugger_nodes",
                                     "debugger_ranks",
                                     "no_signal_handler",
                                     "fp_trap",
                                     "skip_petscrc",
                                     "help",
                                     "version",
                                     "error_output_none",
                                     "error_output_stdout",
                                     "check_pointer_intensity"};

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

std::string advice(const std::string& name) {
  const auto closest = std::ranges::min_element(
      kOptions, {}, [&name](const OptionText& option) { return distance(name, option.name); });
  if (closest->name == name) return "an option that this scene uses (it has no use here)";
  std::string known = "one of crackle -help, or an option of the solver in use";
  if (reaches_solver(name)) return known + " (-equilibrium ksp has a KSP)";
  if (distance(name, closest->name) > 3) return known;
  return known + "; did you mean " + closest->name + "?";
}

/// Name to value, for the options that decide results.
std::map<std::string, std::string> decisive(const std::string& text) {
  std::map<std::string, std::string> options;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t space = line.find(' ');
    const std::string name = line.substr(0, space);
    if (decides_results(name)) options[name] = space == std::string::npos ? "" : line.substr(space + 1);
  }
  return options;
}

bool is_late(const std::string& bare_name) {
  return std::ranges::find(kLateOptions, bare_name) != kLateOptions.end();
}

}  // namespace

const OptionText& find_option(const std::string& name) {
  return *std::ranges::find(kOptions, name,
                            [](const OptionText& option) { return std::string(option.name); });
}

std::string format_help(bool comparison) {
  std::string text =
      "crackle breaks disordered spring and fuse lattices bond by bond.\n\n"
      "Options of crackle (default) meaning; allowed values\n";
  for (const OptionText& option : kOptions) {
    if (!comparison && std::string(option.name).starts_with("-compare")) continue;
    std::array<char, 400> line{};
    std::snprintf(line.data(), line.size(), "  %-22s (%s) %s; %s\n", option.name, option.standard,
                  option.meaning, option.allowed);
    text += line.data();
  }
  return text + "\nEvery option of PETSc's KSP and PC is one too. PETSc's own follow.\n";
}

bool looks_like_option(const std::string& word) {
  if (word.size() < 2 || word[0] != '-') return false;
  const char first = word[1] == '-' && word.size() > 2 ? word[2] : word[1];
  return std::isalpha(static_cast<unsigned char>(first)) != 0;
}

bool reaches_solver(const std::string& name) {
  return name.starts_with("-ksp_") || name.starts_with("-pc_") || name.starts_with("-mat_");
}

bool decides_results(const std::string& name) {
  const auto own =
      std::ranges::find(kOptions, name, [](const OptionText& option) { return std::string(option.name); });
  if (own != kOptions.end()) return own->decides;
  return name.find("_view") == std::string::npos && name.find("_monitor") == std::string::npos &&
         name.find("_converged_reason") == std::string::npos;
}

std::map<std::string, std::string> solver_options() {
  char* text = nullptr;
  petsc::check(PetscOptionsGetAll(nullptr, &text));
  std::istringstream stream(text);
  petsc::check(PetscFree(text));
  std::map<std::string, std::string> options;
  std::string name;
  for (std::string word; stream >> word;) {
    if (looks_like_option(word)) {
      // PETSc takes no notice of case
      std::ranges::transform(word, word.begin(),
                             [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      name = reaches_solver(word) ? word : "";
      if (!name.empty()) options[name] = "";
    } else if (!name.empty()) {
      options[name].append(options[name].empty() ? "" : " ").append(word);
    }
  }
  return options;
}

std::string option_named_in(const std::string& message) {
  std::istringstream words(message);
  for (std::string word; words >> word;) {
    for (const auto& [name, value] : solver_options()) {
      if (word == value) return std::string(name).append(" ").append(value);
    }
  }
  return "";
}

std::string differing_options(const std::string& ours, const std::string& theirs) {
  const auto here = decisive(ours);
  const auto there = decisive(theirs);
  auto names = here;
  names.insert(there.begin(), there.end());
  std::string result;
  for (const auto& [name, unused] : names) {
    if (name == kSinceLater && (!here.contains(name) || !there.contains(name))) continue;
    const std::string mine = here.contains(name) ? here.at(name) : "not given";
    const std::string other = there.contains(name) ? there.at(name) : "none";
    if (mine == other) continue;
    if (!result.empty()) result += ", ";
    result.append(name).append(" ").append(mine).append(" (the file has ").append(other).append(")");
  }
  return result;
}

void reject_stray_words() {
  int count = 0;
  char** words = nullptr;
  petsc::check(PetscGetArgs(&count, &words));
  for (int i = 1; i < count; ++i) {
    if (looks_like_option(words[i])) continue;
    const bool is_value = i > 1 && looks_like_option(words[i - 1]);
    if (!is_value)
      throw InputError("command line", words[i], "options that begin with -, each with one value");
  }
}

void reject_unused_options() {
  PetscInt count = 0;
  char** names = nullptr;
  char** values = nullptr;
  petsc::check(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  std::string name;
  std::string value;
  for (PetscInt i = 0; i < count && name.empty(); ++i) {
    if (is_late(names[i])) continue;
    name = std::string("-") + names[i];
    value = values[i] == nullptr ? "" : values[i];
  }
  petsc::check(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  if (!name.empty()) throw InputError(name, value, advice(name));
}

}  // namespace crackle
