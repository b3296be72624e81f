/// What a factor in double takes for a null pivot.
#pragma once

namespace crackle {

/// A pivot of L D L^T at or below this fraction of its diagonal entry is null: nothing holds that unknown. Rounding leaves
/// up to 1e-11 where stiffnesses span four decades; what is pinned wrongly shows as a residual.
inline constexpr double kNullPivot = 1e-10;

}  // namespace crackle
