#include "vdb/read_vdb.h"

#include <openvdb/Grid.h>

#include <algorithm>

#include "esvr/error.h"
#include "vdb/archive.h"
#include "vdb/carry.h"
#include "vdb/errors.h"
#include "vdb/grid_names.h"
#include "vdb/metadata.h"
#include "vdb/open_vdb.h"
#include "vdb/tree_reader.h"

namespace esvr::vdb {
namespace {

using openvdb::GridBase;

/// A file and the list of its grids, in the same order.
struct ListedArchive {
  Archive archive;
  std::vector<GridHead> heads;
  std::vector<GridSummary> grids;
};

/// The class by OpenVDB's name for it, for example "level set"; kUnknown for any other text.
GridClass gridClassOf(const std::string& text) {
  switch (GridBase::stringToGridClass(text)) {
    case openvdb::GRID_LEVEL_SET:
      return GridClass::kLevelSet;
    case openvdb::GRID_FOG_VOLUME:
      return GridClass::kFogVolume;
    case openvdb::GRID_STAGGERED:
      return GridClass::kStaggered;
    default:
      return GridClass::kUnknown;
  }
}

std::string reasonToSkip(const ArchiveEntry& entry, const GridSummary& grid) {
  if ((isScalarFloatTree(entry) || isVectorTree(entry)) && grid.activeVoxels == 0)
    return "it has no active voxel";
  if (isScalarFloatTree(entry)) return {};
  if (grid.isVector)
    return "its values are vectors (" + grid.valueType + "), which are fitted by components";
  if (isVectorTree(entry)) return "it is a level set of vectors, which cannot be fitted";
  const std::string type = entry.valueType();
  if (isPointTree(entry.treeType)) return "it holds points (" + type + "), which cannot be fitted";
  if (type == "float" || type == "double")
    return "its tree (" + entry.treeType + ") cannot be fitted; OpenVDB's standard tree can";
  return notAFloatType(type);
}

/// Takes the counts from the file's statistics, if the writer stored them.
bool countFromStatistics(const std::vector<MetaItem>& items, GridSummary& grid) {
  using Corner = std::array<std::int32_t, 3>;
  const auto count = fixedValue<std::int64_t>(items, GridBase::META_FILE_VOXEL_COUNT, "int64");
  const auto low = fixedValue<Corner>(items, GridBase::META_FILE_BBOX_MIN, "vec3i");
  const auto high = fixedValue<Corner>(items, GridBase::META_FILE_BBOX_MAX, "vec3i");
  if (!count || !low || !high || *count < 0) return false;
  grid.activeVoxels = std::uint64_t(*count);
  if (*count > 0)
    grid.activeBox = {{(*low)[0], (*low)[1], (*low)[2]}, {(*high)[0], (*high)[1], (*high)[2]}};
  return true;
}

void countFromTree(Archive& archive, const ArchiveEntry& entry, GridSummary& grid) {
  if (!isScalarFloatTree(entry) && !isVectorTree(entry) && !isIntegerTree(entry)) return;
  const TreeSurvey survey = surveyTree(archive, entry);
  grid.activeVoxels = survey.activeVoxels;
  grid.activeBox = survey.activeBox;
}

GridSummary summarise(Archive& archive, const ArchiveEntry& entry, const GridHead& head) {
  GridSummary grid;
  grid.name = stringValue(head.metadata, GridBase::META_GRID_NAME);
  grid.valueType = entry.valueType();
  grid.savedAsHalf = entry.savedAsHalf;
  grid.storedBytes = entry.gridBytes;
  grid.gridClass = gridClassOf(stringValue(head.metadata, GridBase::META_GRID_CLASS));
  if (!countFromStatistics(head.metadata, grid)) countFromTree(archive, entry, grid);
  grid.isScalar = isScalarFloatTree(entry);
  grid.isVector =
      isVectorTree(entry) && grid.activeVoxels > 0 && grid.gridClass != GridClass::kLevelSet;
  grid.skipReason = reasonToSkip(entry, grid);
  grid.whyNotCarried = whyNotCarried(entry.treeType, archive.vdbVersion());
  return grid;
}

ListedArchive listGrids(Archive archive) {
  ListedArchive listed{std::move(archive), {}, {}};
  for (const auto& entry : listed.archive.entries()) {
    inGrid(entry.name(), [&] {
      listed.heads.push_back(listed.archive.readHead(entry));
      listed.grids.push_back(summarise(listed.archive, entry, listed.heads.back()));
    });
  }
  assignUniqueNames(listed.grids);
  return listed;
}

ValueType valueTypeOf(const GridSummary& grid) {
  if (grid.valueType == "double" || grid.valueType == "vec3d") return ValueType::kDouble;
  return grid.savedAsHalf ? ValueType::kHalf : ValueType::kFloat;
}

/// The properties of a grid, without its background.
GridDescriptor descriptorOf(const ListedArchive& listed, std::size_t i) {
  const GridSummary& summary = listed.grids[i];
  return {.name = summary.name,
          .gridClass = summary.gridClass,
          .valueType = valueTypeOf(summary),
          .transform = listed.heads[i].transform,
          .metadata = withoutFileStatistics(listed.heads[i].metadata)};
}

/// \param component  of a grid of vectors; 0 for others
VolumeGrid readTree(ListedArchive& listed, std::size_t i, std::size_t component,
                    const ReadOptions& options) {
  const GridSummary& summary = listed.grids[i];
  TreeVoxels voxels = readVoxels(listed.archive, listed.archive.entries()[i],
                                 {summary.gridClass, component}, options);
  VolumeGrid grid;
  grid.descriptor = descriptorOf(listed, i);
  grid.descriptor.background = voxels.background;
  grid.volume = std::move(voxels.volume);
  grid.nonFiniteReplaced = voxels.nonFiniteReplaced;
  return grid;
}

VolumeGrid readListedGrid(ListedArchive& listed, std::size_t i, const ReadOptions& options) {
  // Only the type is checked here. Statistics that call the grid empty may be wrong.
  if (!isScalarFloatTree(listed.archive.entries()[i])) throw BadInput(listed.grids[i].skipReason);
  return readTree(listed, i, 0, options);
}

void requireVector(const GridSummary& grid) {
  if (grid.isVector) return;
  throw BadInput(grid.isScalar ? "its values are numbers, not vectors" : grid.skipReason);
}

/// Adds the component to the text of errors.
VolumeGrid readListedComponent(ListedArchive& listed, std::size_t i, std::size_t component,
                               const ReadOptions& options) {
  inGrid(listed.grids[i].uniqueName, [&] { requireVector(listed.grids[i]); });
  return inGrid(componentName(listed.grids[i].uniqueName, component),
                [&] { return readTree(listed, i, component, options); });
}

/// The options with the memory that the components before leave.
ReadOptions besides(const SparseVolume& volume, ReadOptions options) {
  const std::uint64_t values = volume.values.size() * sizeof(float);
  const std::uint64_t bytes = options.memory.isInFile(values) ? 0 : values;
  options.maxBytes -= std::min(options.maxBytes, bytes);
  return options;
}

VectorGrid readListedVector(ListedArchive& listed, std::size_t i, ReadOptions options) {
  VectorGrid vectors;
  for (std::size_t c = 0; c < kComponents; ++c) {
    VolumeGrid component = readListedComponent(listed, i, c, options);
    options = besides(component.volume, options);
    vectors.background[c] = component.descriptor.background;
    if (c == 0) vectors.descriptor = std::move(component.descriptor);
    vectors.components[c] = std::move(component.volume);
    vectors.nonFiniteReplaced += component.nonFiniteReplaced;
  }
  return vectors;
}

}  // namespace

VdbSummary inspectOpenVdb(InputFile& file) {
  ListedArchive listed = listGrids(Archive(file));
  return {"OpenVDB", file.size(), listed.archive.metadata(), std::move(listed.grids)};
}

VolumeGrid readOpenVdbGrid(InputFile& file, const std::string& name, const ReadOptions& options) {
  ListedArchive listed = listGrids(Archive(file));
  const std::size_t i = findGrid(listed.grids, name);
  return inGrid(listed.grids[i].uniqueName, [&] { return readListedGrid(listed, i, options); });
}

VolumeGrid readOpenVdbComponent(InputFile& file, const std::string& name, std::size_t component,
                                const ReadOptions& options) {
  ListedArchive listed = listGrids(Archive(file));
  VolumeGrid grid = readListedComponent(listed, findGrid(listed.grids, name), component, options);
  grid.descriptor.name = componentName(grid.descriptor.name, component);
  if (component > 0) grid.descriptor.metadata.clear();
  return grid;
}

VectorGrid readOpenVdbVector(InputFile& file, const std::string& name, const ReadOptions& options) {
  ListedArchive listed = listGrids(Archive(file));
  return readListedVector(listed, findGrid(listed.grids, name), options);
}

PackedGrid readOpenVdbPacked(InputFile& file, const std::string& name, const ReadOptions& options) {
  ListedArchive listed = listGrids(Archive(file));
  const std::size_t i = findGrid(listed.grids, name);
  ReadOptions mayBeEmpty = options;
  mayBeEmpty.allowEmpty = true;
  const ArchiveEntry& entry = listed.archive.entries()[i];
  if (isVectorTree(entry)) {
    if (listed.grids[i].activeVoxels == 0)
      return {descriptorOf(listed, i), PackedVoxels<PackedVector>{}};
    VectorGrid vectors = readListedVector(listed, i, mayBeEmpty);
    return {std::move(vectors.descriptor), packed(vectors)};
  }
  return inGrid(listed.grids[i].uniqueName, [&]() -> PackedGrid {
    if (!isIntegerTree(entry)) {
      VolumeGrid grid = readListedGrid(listed, i, mayBeEmpty);
      return {std::move(grid.descriptor), packed(grid.volume)};
    }
    return {descriptorOf(listed, i), readIntegers(listed.archive, entry, options)};
  });
}

GridSummary OpenVdb::inspectCarried(const CarriedGrid& grid) const {
  return inGrid(grid.name, [&] {
    InputFile file(std::span(grid.bytes));
    return listGrids(Archive(file, grid)).grids.front();
  });
}

VolumeGrid OpenVdb::readGrid(const CarriedGrid& grid, const ReadOptions& options) const {
  return inGrid(grid.name, [&] {
    InputFile file(std::span(grid.bytes));
    ListedArchive listed = listGrids(Archive(file, grid));
    return readListedGrid(listed, 0, options);
  });
}

VectorGrid OpenVdb::readVector(const CarriedGrid& grid, const ReadOptions& options) const {
  InputFile file(std::span(grid.bytes));
  ListedArchive listed = listGrids(Archive(file, grid));
  return readListedVector(listed, 0, options);
}

}  // namespace esvr::vdb
