/// What crackle_compare's own options ask for.
#pragma once

#include "crackle/compare/compare_run.hpp"
#include "crackle/scene/option_table.hpp"
#include "crackle/scene/scene.hpp"

namespace crackle {

/// Options of crackle_compare alone.
[[nodiscard]] std::span<const Option> compare_options();

/// The scene of a comparison. Throws InputError as read_scenes does, and for several sizes or processes.
[[nodiscard]] Scene read_compared_scene();

/// The options of crackle_compare, noted in scene.options. Throws InputError for a value that isn't allowed, and for
/// what a comparison has no use for: several samples, or another -stop than failure or breaks=n.
[[nodiscard]] CompareOptions read_comparison(Scene& scene);

}  // namespace crackle
