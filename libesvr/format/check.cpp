#include <string>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "format/byte_source.h"
#include "format/packed_sections.h"
#include "format/validity.h"

namespace esvr {
namespace {

using namespace format;

void noteVersion(const SectionTable& table, std::vector<std::string>& notes) {
  if (table.versionMinor > kVersionMinor)
    notes.push_back("newer than this reader: " + versions(table.versionMajor, table.versionMinor));
}

void noteSkipped(const SectionTable& table, std::vector<std::string>& notes) {
  for (const auto& e : table.entries)
    if (!known(e.id.kind))
      notes.push_back("skipped: section " + describe(e.id) + ", " + std::to_string(e.storedBytes) +
                      " bytes");
}

/// Readers of voxels need no map, but no VDB file can be made with one that is damaged.
void requireMap(const StoredGrid& grid, const std::string& file) {
  if (const auto fault = mapFaultOf(grid.descriptor.transform))
    throw BadInput(file + ": grid '" + grid.descriptor.name + "': " + fault->text);
}

void noteGrid(const StoredGrid& grid, std::vector<std::string>& notes) {
  const std::string name = "grid '" + shownName(grid.descriptor.name) + "'";
  if (grid.field.ellipsoidCount() == 0)
    notes.push_back(name +
                    (grid.voxels ? " holds voxels and no ellipsoids" : " has no ellipsoids"));
  if (!grid.farBackground && float(grid.descriptor.background) != grid.field.background)
    notes.push_back(name + " has one background in its descriptor and another in its field");
}

void noteCarried(const CarriedGrid& grid, std::vector<std::string>& notes) {
  notes.push_back("grid '" + shownName(grid.name) + "' is carried unchanged (" +
                  shownName(grid.treeType) + ")");
}

/// The file without its carried grids, whose bytes are not decoded.
std::vector<std::byte> encodedWithoutCarried(EsvrFile file) {
  file.carried.clear();
  return encodeEsvr(file);
}

}  // namespace

std::vector<std::string> checkEsvr(const std::filesystem::path& path, const ReadLimits& allowed) {
  ReadLimits limits = allowed;
  limits.carriedBytes = false;  // they are checked, but not kept
  const auto table = readAllRows(FileSource(path));
  const EsvrFile file = readEsvr(path, limits);
  if (encodedWithoutCarried(file) != encodedWithoutCarried(readEsvr(path, limits)))
    throw BadInput(path.string() + ": decoding it twice gives two contents");

  std::vector<std::string> notes;
  noteVersion(table, notes);
  noteSkipped(table, notes);
  for (const auto& grid : file.grids) {
    requireMap(grid, path.string());
    noteGrid(grid, notes);
  }
  for (const auto& grid : file.carried) noteCarried(grid, notes);
  return notes;
}

}  // namespace esvr
