#include "vdb/read_vdb.h"

#include <openvdb/Grid.h>

#include <algorithm>
#include <map>

#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "vdb/archive.h"
#include "vdb/carry.h"
#include "vdb/errors.h"
#include "vdb/grid_names.h"
#include "vdb/metadata.h"
#include "vdb/tree_reader.h"

namespace esvr::vdb {
namespace {

using openvdb::GridBase;

/// A grid of an archive and what is known of it before its voxels are read.
struct ListedGrid {
  std::size_t place = 0;
  GridHead head;
  GridSummary summary;
};

/// What trees hold, by their owners' positions. A tree that many grids share is surveyed once.
using Surveys = std::map<std::uint64_t, TreeSurvey>;

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
    return "its tree (" + shownName(entry.treeType) +
           ") cannot be fitted; OpenVDB's standard tree can";
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

void countFromTree(Archive& archive, const ArchiveEntry& entry, Surveys& surveys,
                   GridSummary& grid) {
  if (!isPackedTree(entry)) return;
  const std::uint64_t owner = archive.treeOwner(entry).gridAt;
  auto survey = surveys.find(owner);
  if (survey == surveys.end()) survey = surveys.emplace(owner, surveyTree(archive, entry)).first;
  grid.activeVoxels = survey->second.activeVoxels;
  grid.activeBox = survey->second.activeBox;
}

GridSummary summarise(Archive& archive, const ArchiveEntry& entry, const GridHead& head,
                      Surveys& surveys) {
  GridSummary grid;
  grid.name = stringValue(head.metadata, GridBase::META_GRID_NAME);
  grid.valueType = entry.valueType();
  grid.savedAsHalf = entry.savedAsHalf;
  grid.storedBytes = entry.gridBytes;
  grid.gridClass = gridClassOf(stringValue(head.metadata, GridBase::META_GRID_CLASS));
  if (!countFromStatistics(head.metadata, grid)) countFromTree(archive, entry, surveys, grid);
  grid.isScalar = isScalarFloatTree(entry);
  grid.isVector =
      isVectorTree(entry) && grid.activeVoxels > 0 && grid.gridClass != GridClass::kLevelSet;
  grid.skipReason = reasonToSkip(entry, grid);
  grid.whyNotCarried = whyNotCarried(entry.treeType, archive.vdbVersion());
  return grid;
}

/// The name of a grid in errors: the unique name in the list of grids.
std::string shownNameOf(const Archive& archive, std::size_t place) {
  std::vector<std::string> names;
  for (const ArchiveEntry& entry : archive.entries()) names.push_back(entry.name());
  return GridNames(std::move(names)).unique(place);
}

/// Runs `body` and adds the name of a grid to the text of its errors.
template <class Body>
decltype(auto) inGridAt(const Archive& archive, std::size_t place, Body&& body) {
  return inNamedGrid([&] { return shownNameOf(archive, place); }, std::forward<Body>(body));
}

/// Lists one grid, whatever other grids the archive has. Its unique name is not set.
ListedGrid listGrid(Archive& archive, std::size_t place, Surveys& surveys) {
  requireGrid(place, archive.entries().size());
  return inGridAt(archive, place, [&] {
    const ArchiveEntry& entry = archive.entries()[place];
    ListedGrid listed{place, archive.readHead(entry), {}};
    listed.summary = summarise(archive, entry, listed.head, surveys);
    return listed;
  });
}
ListedGrid listGrid(Archive& archive, std::size_t place) {
  Surveys none;
  return listGrid(archive, place, none);
}

ValueType valueTypeOf(const GridSummary& grid) {
  if (grid.valueType == "double" || grid.valueType == "vec3d") return ValueType::kDouble;
  return grid.savedAsHalf ? ValueType::kHalf : ValueType::kFloat;
}

/// The properties of a grid, without its background.
GridDescriptor descriptorOf(const ListedGrid& listed) {
  return {.name = listed.summary.name,
          .gridClass = listed.summary.gridClass,
          .valueType = valueTypeOf(listed.summary),
          .transform = listed.head.transform,
          .metadata = withoutFileStatistics(listed.head.metadata)};
}

/// \param component  of a grid of vectors; 0 for others
VolumeGrid readTree(Archive& archive, const ListedGrid& listed, std::size_t component,
                    const ReadOptions& options) {
  const GridSummary& summary = listed.summary;
  TreeVoxels voxels =
      readVoxels(archive, archive.entries()[listed.place], {summary.gridClass, component}, options);
  VolumeGrid grid;
  grid.descriptor = descriptorOf(listed);
  grid.descriptor.background = voxels.background;
  grid.volume = std::move(voxels.volume);
  grid.nonFiniteReplaced = voxels.nonFiniteReplaced;
  grid.inactive = voxels.inactive;
  return grid;
}

VolumeGrid readListedGrid(Archive& archive, const ListedGrid& listed, const ReadOptions& options) {
  return inGridAt(archive, listed.place, [&] {
    // Only the type is checked here. Statistics that call the grid empty may be wrong.
    if (!isScalarFloatTree(archive.entries()[listed.place]))
      throw BadInput(listed.summary.skipReason);
    return readTree(archive, listed, 0, options);
  });
}

void requireVector(const GridSummary& grid) {
  if (grid.isVector) return;
  throw BadInput(grid.isScalar ? "its values are numbers, not vectors" : grid.skipReason);
}

/// Adds the component to the text of errors.
VolumeGrid readListedComponent(Archive& archive, const ListedGrid& listed, std::size_t component,
                               const ReadOptions& options) {
  inGridAt(archive, listed.place, [&] { requireVector(listed.summary); });
  return inNamedGrid([&] { return componentName(shownNameOf(archive, listed.place), component); },
                     [&] { return readTree(archive, listed, component, options); });
}

/// The options with the memory that the components before leave.
ReadOptions besides(const SparseVolume& volume, ReadOptions options) {
  const std::uint64_t values = volume.values.size() * sizeof(float);
  const std::uint64_t bytes = options.memory.isInFile(values) ? 0 : values;
  options.maxBytes -= std::min(options.maxBytes, bytes);
  return options;
}

VectorGrid readListedVector(Archive& archive, const ListedGrid& listed, ReadOptions options) {
  VectorGrid vectors;
  for (std::size_t c = 0; c < kComponents; ++c) {
    VolumeGrid component = readListedComponent(archive, listed, c, options);
    options = besides(component.volume, options);
    vectors.background[c] = component.descriptor.background;
    if (c == 0) vectors.descriptor = std::move(component.descriptor);
    vectors.components[c] = std::move(component.volume);
    vectors.nonFiniteReplaced += component.nonFiniteReplaced;
    vectors.inactive.add(component.inactive.ofComponent(c));
  }
  return vectors;
}

PackedGrid readListedPacked(Archive& archive, const ListedGrid& listed,
                            const ReadOptions& options) {
  return inGridAt(archive, listed.place, [&]() -> PackedGrid {
    const ArchiveEntry& entry = archive.entries()[listed.place];
    if (!isPackedTree(entry))
      throw BadInput("its tree (" + shownName(entry.treeType) +
                     ") cannot be read; those of numbers, 3D vectors and masks can");
    return {descriptorOf(listed), readPackedVoxels(archive, entry, options)};
  });
}

}  // namespace

VdbSummary inspectOpenVdb(InputFile& file) {
  Archive archive(file);
  VdbSummary summary{"OpenVDB", file.size(), archive.metadata(), {}};
  Surveys surveys;
  for (std::size_t place = 0; place < archive.entries().size(); ++place)
    summary.grids.push_back(std::move(listGrid(archive, place, surveys).summary));
  assignUniqueNames(summary.grids);
  return summary;
}

VolumeGrid readOpenVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options) {
  Archive archive(file);
  return readListedGrid(archive, listGrid(archive, place), options);
}

VolumeGrid readOpenVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options) {
  Archive archive(file);
  VolumeGrid grid = readListedComponent(archive, listGrid(archive, place), component, options);
  grid.descriptor.name = componentName(grid.descriptor.name, component);
  if (component > 0) grid.descriptor.metadata.clear();
  return grid;
}

VectorGrid readOpenVdbVector(InputFile& file, std::size_t place, const ReadOptions& options) {
  Archive archive(file);
  return readListedVector(archive, listGrid(archive, place), options);
}

PackedGrid readOpenVdbPacked(InputFile& file, std::size_t place, const ReadOptions& options) {
  Archive archive(file);
  return readListedPacked(archive, listGrid(archive, place), options);
}

}  // namespace esvr::vdb

namespace esvr {

GridSummary inspectCarried(const CarriedGrid& grid) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  GridSummary summary = vdb::listGrid(archive, 0).summary;
  summary.uniqueName = shownName(summary.name);
  return summary;
}

VolumeGrid readGrid(const CarriedGrid& grid, const ReadOptions& options) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  return vdb::readListedGrid(archive, vdb::listGrid(archive, 0), options);
}

VectorGrid readVector(const CarriedGrid& grid, const ReadOptions& options) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  return vdb::readListedVector(archive, vdb::listGrid(archive, 0), options);
}

PackedGrid readPacked(const CarriedGrid& grid, const ReadOptions& options) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  return vdb::readListedPacked(archive, vdb::listGrid(archive, 0), options);
}

}  // namespace esvr
