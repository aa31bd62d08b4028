#pragma once
/// The files in tests/format/golden: what is in them, and how version 1 wrote them. They stay as
/// they are: whoever changes the format must still read them.

#include <cstddef>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::test {

struct GoldenFile {
  std::string name;
  EsvrFile content;
  bool written = true;          ///< else an older version did: it is only read
  bool unknownSection = false;  ///< followed by an optional section of a kind nobody knows
};

[[nodiscard]] std::vector<GoldenFile> goldenFiles();

/// The file as this library writes it.
[[nodiscard]] std::vector<std::byte> bytesOf(const GoldenFile& golden);

}  // namespace esvr::test
