#pragma once
/// How often a test repeats what it does with random or damaged input.

#include <cstddef>

namespace esvr::test {

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ESVR_ADDRESS_SANITIZER
#endif
#endif

/// Under the address sanitizer, each trial takes about ten times as long, and the fuzzers try more of them.
#if defined(ESVR_ADDRESS_SANITIZER) || defined(__SANITIZE_ADDRESS__)
inline constexpr std::size_t kFewerTrials = 8;
#else
inline constexpr std::size_t kFewerTrials = 1;
#endif

/// The number of trials of a test that makes `usual` ones in an ordinary build.
constexpr int trials(int usual) { return usual / int(kFewerTrials); }

/// The distance between the bytes that a test damages, if it is `usual` in an ordinary build.
constexpr std::size_t stride(std::size_t usual) {
  return usual * kFewerTrials - (kFewerTrials - 1);
}

}  // namespace esvr::test
