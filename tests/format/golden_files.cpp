#include "format/golden_files.h"

#include "format/crafted_file.h"
#include "format/sample_files.h"

namespace esvr::test {
namespace {

constexpr auto kKindOfNoVersion = format::SectionKind(0x7e57);

/// Every number typed here, none computed.
EncodedGrid oneEllipsoid() {
  EncodedGrid grid = emptyGrid();
  grid.descriptor.name = "density";
  Ellipsoids e;
  e.resize(1);
  e.center = {{{1.5f}, {-2.25f}, {1000.0f}}};
  e.logScale = {{{0.0f}, {-1.0f}, {2.5f}}};
  e.rotation = {{{0.8f}, {0.0f}, {-0.6f}, {0.0f}}};
  e.intensity = {0.75f};
  grid.field.chunks = {{{10, -20, 30}, e}};
  return grid;
}

}  // namespace

std::vector<GoldenFile> goldenFiles() {
  return {
      {"no_grid", {}},
      {"one_ellipsoid", fileOf(oneEllipsoid())},
      {"two_grids", {everything(0).metadata, {fogGrid(3), levelSetGrid(2)}}},
      {"level_set", fileOf(levelSetGrid(2))},
      {"kappas_and_chunks", fileOf(chunkedGrid(4))},
      {"compressed", fileOf(fogGrid(60))},
      {"quantised", fileOf(quantisedGrid(20))},
      {"unknown_section", fileOf(oneEllipsoid()), true},
  };
}

std::vector<std::byte> bytesOf(const GoldenFile& golden) {
  const auto bytes = encodeEsvr(golden.content);
  if (!golden.unknownSection) return bytes;
  CraftedFile file(bytes);
  file.add({kKindOfNoVersion, 0}, 0, bytesOf("of a later version"));
  return file.assemble();
}

}  // namespace esvr::test
