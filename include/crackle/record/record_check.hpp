/// What a sample's record can't be: numbers that no run leaves behind, whatever their checksums say.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "crackle/record/part.hpp"

namespace crackle {

/// Sample numbers are 0 to this.
inline constexpr std::int64_t kLastSample = std::numeric_limits<std::int64_t>::max() - 1;

/// Throws InputError for numbers of samples that are out of range or don't ascend.
void check_numbers(std::span<const std::int64_t> index);

/// Throws InputError, naming dataset, sample, value and what is allowed, for
///  - a load, displacement, stiffness, force or time that is NaN, infinite or negative (F: or 0), a bond out of range
///    or broken twice;
///  - n_f unlike the number of breaks, n_p or the peak unlike the largest load, which the first one to reach it has, F at
///    first unlike the initial stiffness;
///  - a profile whose sums aren't n_p and n_f; a snapshot missing, of another break or another size, or with a force in
///    a broken bond.
void check_records(std::span<const SampleRecord> records, const RecordFacts& facts);

}  // namespace crackle
