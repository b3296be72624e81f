#include "crackle/ensemble/report.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <numeric>
#include <vector>

namespace crackle {

namespace {

void print_estimates(std::span<const SampleSummary> samples) {
  const auto line = [samples](const char* name, auto field) {
    std::vector<double> values;
    for (const SampleSummary& sample : samples) values.push_back(static_cast<double>(sample.*field));
    const Estimate e = estimate(values);
    std::printf("  %-20s %12.6g +- %.2g\n", name, e.mean, e.error);
  };
  std::printf("%zu samples, mean and standard error\n", samples.size());
  line("peak load", &SampleSummary::peak_load);
  line("peak displacement", &SampleSummary::peak_displacement);
  line("n_p", &SampleSummary::n_p);
  line("n_f", &SampleSummary::n_f);
}

void print_times(const EquilibriumCounts& counts, const PhaseTimes& times, double seconds) {
  const double breaks = static_cast<double>(counts.breaks);
  std::printf("run time %.3f s, %lld breaks, %.4g ms a break\n", seconds,
              static_cast<long long>(counts.breaks), 1e3 * seconds / breaks);
  double named = 0;
  const auto row = [&](const char* name, double part) {
    std::printf("  %-20s %10.3f s %12.4g ms a break %6.1f %%\n", name, part, 1e3 * part / breaks,
                100 * part / seconds);
  };
  for (std::size_t phase = 0; phase < kPhases; ++phase) {
    named += times.seconds[phase];
    row(kPhaseNames[phase], times.seconds[phase]);
  }
  row("other", seconds - named);
}

void print_referee(const EquilibriumCounts& counts) {
  const std::string doubt = describe_doubt(counts);
  if (!doubt.empty()) std::printf("  doubtful network     %s\n", doubt.c_str());
  if (counts.refereed > 0) {
    std::printf("  refereed breaks      %lld, where double precision could not tell which bond is next\n",
                static_cast<long long>(counts.refereed));
  }
  if (counts.held > 0) {
    std::printf(
        "  never failed         %lld samples, whose last bonds can't break; F/F0 up to %.4g is left\n",
        static_cast<long long>(counts.held), counts.largest_left);
  }
}

void print_counts(const EquilibriumCounts& counts) {
  std::printf("equilibrium: %lld unknowns, %lld factorizations, %lld refactors asked for by a check\n",
              static_cast<long long>(counts.unknowns), static_cast<long long>(counts.factorizations),
              static_cast<long long>(counts.refactors));
  if (counts.factor_entries > 0)
    std::printf("  factor entries       %lld\n", static_cast<long long>(counts.factor_entries));
  if (counts.iterations > counts.breaks) {
    std::printf("  iterations a break   %.4g\n",
                static_cast<double>(counts.iterations) / static_cast<double>(counts.breaks));
  }
  if (counts.confirmations > 0) {
    std::printf("  ends looked into     %lld, where the solver gave up\n",
                static_cast<long long>(counts.confirmations));
  }
  print_referee(counts);
  if (counts.doubtful > 0) {
    std::printf(
        "  doubtful breaks      %lld, the first at break %lld of its sample: with residuals up to %.1g "
        "another bond\n"
        "                       may break; try a tighter -ksp_rtol\n",
        static_cast<long long>(counts.doubtful), static_cast<long long>(counts.first_doubtful),
        counts.loosest_residual);
  }
  if (counts.null_pivots > 0)
    std::printf("  null pivots pinned   %lld\n", static_cast<long long>(counts.null_pivots));
  if (counts.smallest_slack < 1) std::printf("  smallest slack       %.3g\n", counts.smallest_slack);
  if (counts.checks > 0)
    std::printf("  residual checked     at %lld breaks\n", static_cast<long long>(counts.checks));
  if (counts.largest_residual > 0) std::printf("  largest residual     %.3g\n", counts.largest_residual);
}

}  // namespace

Estimate estimate(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  if (values.empty()) return {};
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, n < 2 ? 0 : std::sqrt(squares / (n - 1) / n)};
}

void print_report(std::span<const SampleSummary> samples, const EquilibriumCounts& counts,
                  const PhaseTimes& times, double seconds, const std::string& path) {
  std::printf("\n");
  print_estimates(samples);
  if (counts.breaks > 0) {
    print_times(counts, times, seconds);
    print_counts(counts);
  }
  std::printf("written: %s\n", path.c_str());
}

void print_run_time(double seconds, int processes) {
  std::printf("\nall of it: %.3f s on %d process%s\n", seconds, processes, processes == 1 ? "" : "es");
}

void print_early_end(int signal) {
  std::printf("ended early by signal %d (%s); -resume goes on\n", signal, strsignal(signal));
}

}  // namespace crackle
