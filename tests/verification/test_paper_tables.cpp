/// Tables 1 and 2 of P. K. V. V. Nukala, S. Zapperi, S. Simunovic, Phys. Rev. E 71 (2005) 066106: means
/// within four standard errors (ours and the paper's) plus one bond, standard deviations within 10 %.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "verification.hpp"

namespace crackle::verification {

namespace {

struct Moments {
  double mean = 0;
  double deviation = 0;
};

struct PaperRow {
  double samples = 0;
  Moments p_p, p_f, peak_load;
};

PaperRow read_row(int size) {
  std::ifstream file(CRACKLE_TABLES);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(std::to_string(size) + ",")) continue;
    std::ranges::replace(line, ',', ' ');
    std::istringstream values(line);
    PaperRow row;
    int found = 0;
    values >> found >> row.samples >> row.p_p.mean >> row.p_p.deviation >> row.p_f.mean >>
        row.p_f.deviation >> row.peak_load.mean >> row.peak_load.deviation;
    if (values && found == size) return row;
  }
  throw std::runtime_error("no such size in the paper's tables");
}

Moments moments(const std::vector<double>& values) {
  Moments m;
  for (const double value : values) m.mean += value / static_cast<double>(values.size());
  for (const double value : values) m.deviation += (value - m.mean) * (value - m.mean);
  m.deviation = std::sqrt(m.deviation / static_cast<double>(values.size() - 1));
  return m;
}

/// `unit`: what one bond is worth, 0 for the load.
void compare(const char* name, const std::vector<double>& values, const Moments& paper, double paper_samples,
             double unit) {
  const Moments ours = moments(values);
  const double error = std::hypot(ours.deviation / std::sqrt(static_cast<double>(values.size())),
                                  paper.deviation / std::sqrt(paper_samples));
  std::printf("  %-10s %8.4f (paper %8.4f, %+5.2f standard errors)   deviation %8.4f (paper %8.4f)\n", name,
              ours.mean, paper.mean, (ours.mean - paper.mean) / error, ours.deviation, paper.deviation);
  EXPECT_LE(std::abs(ours.mean - paper.mean), 4 * error + unit) << name;
  EXPECT_LE(std::abs(ours.deviation / paper.deviation - 1), 0.1) << name;
}

struct Ensemble {
  int size;
  int samples;
};

/// Names the test.
std::ostream& operator<<(std::ostream& out, const Ensemble& ensemble) {
  return out << "L" << ensemble.size;
}

class PaperTables : public testing::TestWithParam<Ensemble> {};

TEST_P(PaperTables, MeansAndDeviations) {
  const auto [size, samples] = GetParam();
  const PaperRow paper = read_row(size);
  const Network network = triangular({Model::spring, Grips::sliding, BreakOn::magnitude, size});
  PhaseTimes times;
  const auto equilibrium = start(kUpdown, network, BreakOn::magnitude, times);
  const double bonds = network.bonds();
  std::vector<double> p_p;
  std::vector<double> p_f;
  std::vector<double> peak_load;
  for (int sample = 0; sample < samples; ++sample) {
    const SampleSummary summary = break_whole(*equilibrium, 1, sample).summary;
    p_p.push_back(summary.n_p / bonds);
    p_f.push_back((summary.n_f + 1) / bonds);  // the paper counts the step at which nothing carries, too
    peak_load.push_back(summary.peak_load);
  }
  std::printf("L = %d, %d samples\n", size, samples);
  compare("p_p", p_p, paper.p_p, paper.samples, 1 / bonds);
  compare("p_f", p_f, paper.p_f, paper.samples, 0.5 / bonds);
  compare("peak load", peak_load, paper.peak_load, paper.samples, 0);
}

INSTANTIATE_TEST_SUITE_P(Sizes, PaperTables,
                         testing::Values(Ensemble{8, 4000}, Ensemble{16, 2000}, Ensemble{24, 1000},
                                         Ensemble{32, 500}),
                         testing::PrintToStringParamName());

}  // namespace

}  // namespace crackle::verification
