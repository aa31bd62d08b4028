#pragma once
/// The content of the files in tests/format/golden, and how this version of the format writes them.

#include <cstddef>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::test {

struct GoldenFile {
  std::string name;
  EsvrFile content;
  bool unknownSection = false;  ///< an optional section of an unknown kind follows
};

[[nodiscard]] std::vector<GoldenFile> goldenFiles();

/// The file as this library writes it.
[[nodiscard]] std::vector<std::byte> bytesOf(const GoldenFile& golden);

}  // namespace esvr::test
