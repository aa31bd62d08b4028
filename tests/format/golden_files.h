#pragma once
/// The files in tests/format/golden: their content, and how this version of the format writes it.

#include <cstddef>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::test {

struct GoldenFile {
  std::string name;
  EsvrFile content;
  bool unknownSection = false;  ///< followed by an optional section of a kind nobody knows
};

[[nodiscard]] std::vector<GoldenFile> goldenFiles();

/// The file as this library writes it.
[[nodiscard]] std::vector<std::byte> bytesOf(const GoldenFile& golden);

}  // namespace esvr::test
