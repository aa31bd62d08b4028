#include "vdb/read_nvdb.h"

#include "esvr/error.h"
#include "vdb/errors.h"
#include "vdb/grid_names.h"
#include "vdb/nano_file.h"
#include "vdb/nano_grid.h"

namespace esvr::vdb {
namespace {

/// Converts NanoVDB's number of a class; the classes shared with OpenVDB have the same numbers
/// here.
GridClass gridClassOf(std::uint32_t nanoClass) {
  return nanoClass <= std::uint32_t(GridClass::kStaggered) ? GridClass(nanoClass)
                                                           : GridClass::kUnknown;
}

GridSummary summarise(const NanoEntry& entry) {
  GridSummary grid;
  grid.name = entry.name;
  grid.valueType = nanoValueType(entry.gridType);
  grid.gridClass = gridClassOf(entry.gridClass);
  grid.activeVoxels = entry.activeVoxels;
  grid.activeBox = entry.activeBox;
  grid.storedBytes = entry.storedBytes;
  grid.isScalar = isScalarFloatNano(entry.gridType);
  grid.skipReason = grid.isScalar ? "" : notAFloatType(grid.valueType);
  if (grid.skipReason.empty() && entry.activeVoxels == 0)
    grid.skipReason = "it has no active voxel";
  grid.whyNotCarried = "only the grids of .vdb files can be carried unchanged";
  return grid;
}

std::vector<GridSummary> summarise(const std::vector<NanoEntry>& entries) {
  std::vector<GridSummary> grids;
  for (const auto& entry : entries) grids.push_back(summarise(entry));
  assignUniqueNames(grids);
  return grids;
}

}  // namespace

VdbSummary inspectNanoVdb(InputFile& file) {
  return {"NanoVDB", file.size(), {}, summarise(readNanoDirectory(file))};
}

VolumeGrid readNanoVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options) {
  const auto entries = readNanoDirectory(file);
  const auto grids = summarise(entries);
  requireGrid(place, grids.size());
  return inGrid(grids[place].uniqueName, [&] {
    if (!isScalarFloatNano(entries[place].gridType)) throw BadInput(grids[place].skipReason);
    const NanoBuffer buffer = readNanoBuffer(file, entries[place], options.maxBytes);
    VolumeGrid grid =
        readNanoVoxels(buffer, entries[place].gridType, grids[place].gridClass, options);
    grid.descriptor.name = grids[place].name;
    return grid;
  });
}

}  // namespace esvr::vdb
