#pragma once
/// Float values that are not finite.

#include <limits>

namespace esvr::test {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInf = std::numeric_limits<float>::infinity();

}  // namespace esvr::test
