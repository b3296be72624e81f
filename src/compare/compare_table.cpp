#include "crackle/compare/compare_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

namespace crackle {

namespace {

template <class... Values>
std::string print(const char* format, Values... values) {
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...)), '\0');
  std::snprintf(text.data(), text.size() + 1, format, values...);
  return text;
}

/// Largest of those that were measured; NaN for none.
double largest(const std::vector<double>& values) {
  double result = std::numeric_limits<double>::quiet_NaN();
  for (const double value : values) result = std::fmax(result, value);
  return result;
}

std::string format_time(const StrategyRun& run, std::int64_t breaks) {
  std::vector<double> total;
  for (const double seconds : run.total) {
    if (!std::isnan(seconds)) total.push_back(1e3 * seconds / static_cast<double>(breaks));
  }
  if (total.empty()) return "            -";
  std::ranges::sort(total);
  const double spread = (total.back() - total.front()) / 2;
  return print("%8.3f +-%5.2g", total[total.size() / 2], spread);
}

std::string format_row(const StrategyRun& run, const ReferenceRun& reference) {
  const std::int64_t breaks = std::max<std::int64_t>(1, run.n_f - reference.skip);
  const double iterations = static_cast<double>(run.counts.iterations) / static_cast<double>(breaks);
  const std::string difference = run.first_difference > 0 ? std::to_string(run.first_difference) : "none";
  return print("%-22s %s %9.1f %9.1e %9.1e %9.1e %9s %9.1e %6lld %6lld %8.1f\n", run.choice.name.c_str(),
               format_time(run, breaks).c_str(), iterations, largest(run.residual), largest(run.force_error),
               largest(run.load_error), difference.c_str(), std::abs(run.peak_load / reference.peak_load - 1),
               static_cast<long long>(run.n_p), static_cast<long long>(run.n_f),
               static_cast<double>(run.memory) / (1 << 20));
}

/// What it did about trouble.
std::string format_notes(const StrategyRun& run) {
  std::string notes;
  if (run.counts.refactors > 0) {
    notes += print("%s: a check asked for %lld new factors\n", run.choice.name.c_str(),
                   static_cast<long long>(run.counts.refactors));
  }
  if (run.counts.doubtful > 0) {
    notes +=
        print("%s: residuals up to %.1g leave open which bond breaks at %lld breaks, from break %lld on\n",
              run.choice.name.c_str(), run.counts.loosest_residual,
              static_cast<long long>(run.counts.doubtful), static_cast<long long>(run.counts.first_doubtful));
  }
  if (!run.complaint.empty()) notes += run.choice.name + ": ended " + run.complaint + "\n";
  return notes;
}

}  // namespace

std::string format_comparison(const ReferenceRun& reference, std::span<const StrategyRun> runs,
                              const CompareOptions& options) {
  std::string text = print(
      "\nreference: %s\n  %lld breaks (%s), peak load %.6g at n_p %lld, largest error estimate %.1e, %.1f "
      "s\n",
      reference.name.c_str(), static_cast<long long>(reference.n_f), reference.failed ? "failure" : "-stop",
      reference.peak_load, static_cast<long long>(reference.n_p), largest(reference.error),
      reference.seconds);
  if (reference.skip > 0) {
    text += print("  the first %lld breaks are those of tree, and not compared\n",
                  static_cast<long long>(reference.skip));
  }
  text +=
      options.along == Along::reference
          ? "Every strategy solves the networks along the reference's breaks; where it names another bond, "
            "it goes on with the\nreference's. Errors are the largest of every "
          : "Every strategy breaks its own bonds; errors end where it first names another one. Errors are "
            "the "
            "largest of every ";
  text += print("%lld-th break; times a break (processor): median of %d runs.\n\n",
                static_cast<long long>(options.every), options.repetitions);
  text += print("%-22s %16s %9s %9s %9s %9s %9s %9s %6s %6s %8s\n", "strategy", "ms a break", "iterat.",
                "residual", "forces", "loads", "1st diff.", "peak", "n_p", "n_f", "MiB");
  for (const StrategyRun& run : runs) text += format_row(run, reference);
  for (const StrategyRun& run : runs) text += format_notes(run);
  return text;
}

}  // namespace crackle
