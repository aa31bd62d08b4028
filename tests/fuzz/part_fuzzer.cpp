// Reads parts of an .esvr file with corrected checksums: some layers, some ellipsoids, a box, and
// coarser levels of detail of the result. The first bytes choose the part. If the whole file is
// valid, a part of it must be readable, and its voxels become a valid volume or are refused.

#include <cstdint>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "fuzz/input_file.h"
#include "fuzz/repair.h"

namespace {

using namespace esvr;

constexpr std::uint64_t kMaxContent = std::uint64_t{64} << 20, kMaxVoxels = std::uint64_t{8} << 20;
constexpr std::size_t kChoiceBytes = 4;

Box boxFrom(const std::uint8_t* choice) {
  const Coord corner{choice[1] % 64 - 32, choice[2] % 64 - 32, choice[3] % 64 - 32};
  return {corner, corner + Coord{15, 7, 30}};
}

ReadPart partFrom(const std::uint8_t* choice) {
  ReadPart part;
  part.limits.maxBytes = kMaxContent;
  if (choice[0] & 1) part.layers = 1 + choice[1] % 4;
  if (choice[0] & 2) part.ellipsoids = 1 + choice[2];
  if (choice[0] & 4) part.box = boxFrom(choice);
  if (choice[0] & 8) part.grids = std::vector<std::size_t>{choice[1] % std::size_t{4}};
  part.carriedBytes = (choice[0] & 16) != 0;
  return part;
}

void decode(const StoredGrid& grid, const std::optional<Box>& box) {
  try {
    checkInvariants(decodeGrid(grid, {.box = box, .maxBytes = kMaxVoxels}));
  } catch (const MemoryExceeded&) {
  } catch (const RuntimeFailure&) {  // supports are 2^31 voxels apart
  }
}

void readAndDecode(const std::filesystem::path& path, const ReadPart& part, std::size_t count) {
  const PartOfFile read = readEsvrPart(path, part);
  for (const StoredGrid& grid : read.file.grids) {
    decode(grid, part.box);
    decode(firstLayers(grid, 1), part.box);
    decode(heaviest(grid, count), part.box);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::InputFile file(".esvr");
  if (size < kChoiceBytes) return 0;
  const auto bytes =
      fuzz::repaired(std::as_bytes(std::span(data + kChoiceBytes, size - kChoiceBytes)));
  try {
    readAndDecode(file.write(bytes.data(), bytes.size()), partFrom(data), 1 + data[3] % 16);
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
  return 0;
}
