/// Strategies to compare: a file of solver options each, and for iterations a tolerance.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace crackle {

struct StrategyChoice {
  std::string name;                            ///< "jacobi 1e-4" of options/solver/jacobi.opts
  std::string file;                            ///< where its options stand
  std::string rtol;                            ///< -ksp_rtol as typed; empty: the file's, or the default
  std::map<std::string, std::string> options;  ///< -name to value, rtol included
};

/// One choice for each file; where the file's solver iterates, one for each tolerance.
/// Throws InputError, naming it, for a file that can't be read.
[[nodiscard]] std::vector<StrategyChoice> choose_strategies(std::span<const std::string> files,
                                                            std::span<const std::string> tolerances);

/// PETSc's options database has a strategy's options for the length of this life; what they hid comes back.
class StrategyOptions {
 public:
  explicit StrategyOptions(const StrategyChoice& choice);
  ~StrategyOptions();
  StrategyOptions(const StrategyOptions&) = delete;
  StrategyOptions& operator=(const StrategyOptions&) = delete;

 private:
  std::map<std::string, std::optional<std::string>> before_;
};

}  // namespace crackle
