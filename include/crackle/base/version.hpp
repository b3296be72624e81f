#pragma once

namespace crackle {

inline constexpr const char* kVersion = "0.1.0";

}  // namespace crackle
