/// The comparison file: what crackle_compare leaves behind, in HDF5.
///
///     /                      attributes: kind "comparison", schema_version, code_version, options, created
///     /reference             attributes: name, failed, peak_load, n_p, n_f, skip, seconds
///         bond               int32[skip + B]   in the order of breaking
///         load, stiffness    float64[B]
///         number             int64[K]          breaks measured, from 1
///         error              float64[K]        the reference's estimate of its own force error
///     /strategies/NNN        000, 001, ... in the order of -compare, with more digits where there are a thousand;
///                            attributes: name, file, options, rtol ("" where none), complaint ("" where none),
///                            first_difference (0: none), differences, peak_load,
///                            peak_error, n_p, n_f, memory, factorizations, refactors, confirmations,
///                            iterations, doubtful, first_doubtful (see EquilibriumCounts), largest_residual,
///                            smallest_slack
///         time               float64[R][K]     processor seconds when the break was known
///         total, set_up      float64[R]        processor seconds of all breaks; before the first
///         phase              float64[R][6]     seconds: assembly, factor, downdate, solve, search, output
///         iterations         int64[K]          of that break's solve; -1: not reached
///         residual, backward_error, force_error, load_error      float64[K]; NaN: not reached
#pragma once

#include <span>
#include <string>

#include "crackle/base/output_lock.hpp"
#include "crackle/compare/compare_run.hpp"

namespace crackle {

/// 2: every dataset has a checksum.
inline constexpr std::int32_t kCompareSchemaVersion = 2;

/// The place of a comparison file, from before it is made until it is there.
class CompareFile {
 public:
  /// Takes the output's lock; symbolic links are followed. Throws InputError when the file exists and may not be
  /// replaced, can't be written, or is being written by another program. Make it before time is spent.
  explicit CompareFile(const CompareOptions& options);

  /// The whole file, or none: throws WriteError. options_text: "-name value" a line.
  void write(const std::string& options_text, const ReferenceRun& reference,
             std::span<const StrategyRun> runs);

 private:
  std::string path_;
  OutputLock lock_;
};

}  // namespace crackle
