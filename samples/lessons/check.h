#pragma once
// The lessons are tests as well: each of their claims is checked.

#include <cstdio>
#include <cstdlib>

inline void check(bool condition, const char* claim) {
  std::printf("%s: %s\n", condition ? "true" : "FALSE", claim);
  if (!condition) std::exit(EXIT_FAILURE);
}
