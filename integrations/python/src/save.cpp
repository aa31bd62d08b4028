// Writing the grids of an .esvr file as VDB.

#include <span>
#include <variant>

#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/level_of_detail.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

using Decoded = std::variant<VolumeGrid, VectorGrid>;

StoredGrid cut(StoredGrid grid, const SavedPart& part) {
  if (part.layers) grid = firstLayers(std::move(grid), *part.layers);
  if (part.maxEllipsoids) grid = heaviest(std::move(grid), *part.maxEllipsoids);
  return grid;
}

DecodeOptions decodeOptions(const SavedPart& part) {
  if (part.layers == 0u) throw UsageError("layers must be above 0");
  if (part.maxEllipsoids == 0u) throw UsageError("max_ellipsoids must be above 0");
  DecodeOptions options{.maxBytes = usualMemoryLimit()};
  if (part.box) options.box = boxOf(*part.box);
  if (options.box && options.box->empty()) throw UsageError("the box is empty");
  return options;
}

Decoded decode(const EsvrFile& file, const GridOfFile& grid, const SavedPart& part) {
  const DecodeOptions options = decodeOptions(part);
  if (!grid.isVector) {
    const StoredGrid& stored = file.grids[grid.index];
    return VolumeGrid{stored.descriptor, decodeGrid(cut(stored, part), options)};
  }
  const StoredVector& vector = file.vectors[grid.index];
  std::vector<StoredGrid> parts;
  for (const StoredGrid& component : componentsOf(file, vector))
    parts.push_back(cut(component, part));
  return decodeVector(vector.name, std::span(parts).first<kComponents>(), options);
}

/// The grids that are written, in their order, and the names of the others.
struct Chosen {
  std::vector<GridOfFile> grids;
  std::vector<std::string> leftOut;
};

Chosen choose(const EsvrFile& file, const SavedPart& part) {
  Chosen chosen;
  for (const GridOfFile& grid : gridsInOrder(file))
    if (grid.isCarried && !part.isWhole())
      chosen.leftOut.push_back(nameOf(file, grid));
    else
      chosen.grids.push_back(grid);
  if (chosen.grids.empty() && !chosen.leftOut.empty())
    throw BadInput("no grid is left to write, because carried grids cannot be cut");
  return chosen;
}

/// \param decoded  those of the grids that are not carried
std::vector<GridToWrite> inOrder(const EsvrFile& file, const std::vector<GridOfFile>& grids,
                                 const std::vector<Decoded>& decoded) {
  std::vector<GridToWrite> all;
  auto next = decoded.begin();
  for (const GridOfFile& grid : grids)
    if (grid.isCarried)
      all.emplace_back(&file.carried[grid.index]);
    else
      all.push_back(std::visit([](const auto& g) { return GridToWrite(&g); }, *next++));
  return all;
}

}  // namespace

std::vector<std::string> saveFile(const File& self, const std::filesystem::path& path,
                                  const SavedPart& part, bool overwrite) {
  const EsvrFile& file = *self.file;
  Chosen chosen = choose(file, part);
  std::vector<Decoded> decoded;
  for (const GridOfFile& grid : chosen.grids)
    if (!grid.isCarried) decoded.push_back(decode(file, grid, part));
  writeGrids(path, file.metadata, inOrder(file, chosen.grids, decoded), {.overwrite = overwrite});
  return chosen.leftOut;
}

}  // namespace esvr::python
