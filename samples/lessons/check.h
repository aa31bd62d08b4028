#pragma once
// Lessons are tests as well: what they claim is checked.

#include <cstdio>
#include <cstdlib>

inline void check(bool condition, const char* claim) {
  std::printf("%s: %s\n", condition ? "true" : "FALSE", claim);
  if (!condition) std::exit(EXIT_FAILURE);
}
