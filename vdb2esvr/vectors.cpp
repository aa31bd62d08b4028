#include "vdb2esvr/vectors.h"

#include <algorithm>
#include <span>
#include <utility>

#include "esvr/grid_coding.h"

namespace esvr::vdb2esvr {
namespace {

using Grids = std::vector<ConvertedGrid>;

bool isComplete(const Grids& grids, std::size_t first) {
  return grids.size() - first >= kComponents &&
         grids[first].id.place == grids[first + kComponents - 1].id.place;
}

/// The grids that are not of numbers, by their first components.
std::vector<ConvertedVector> listVectors(const RunRecord& record) {
  std::vector<ConvertedVector> vectors;
  for (std::size_t g = 0; g < record.grids.size(); ++g) {
    const ConvertedGrid& grid = record.grids[g];
    if (grid.id.component != std::size_t{0}) continue;
    const GridSummary& source = record.input.grids[grid.id.place];
    vectors.push_back({source.uniqueName, grid.id.place, source.valueType, {source.name, g}});
  }
  return vectors;
}

/// Removes a vector from the converted grids. Its components are no longer twins of other grids.
void removeVector(std::size_t place, RunRecord& record) {
  std::erase_if(record.grids, [&](const auto& grid) { return grid.id.place == place; });
  for (ConvertedGrid& grid : record.grids)
    if (grid.twinOf && grid.twinOf->place == place) grid.twinOf.reset();
  record.vectors = listVectors(record);
}

/// Bytes that a vector adds to a file.
std::uint64_t bytesAddedBy(const RunRecord& record, const ConvertedVector& vector) {
  std::vector<StoredGrid> components;
  for (std::size_t c = 0; c < kComponents; ++c)
    components.push_back(record.grids[vector.stored.first + c].stored());
  return bytesAddedTogether(std::move(components)) + bytesOfVectors({vector.stored});
}

bool mayCarry(const Options& options) {
  return options.convert.representation == Representation::kAuto &&
         options.convert.storage.form == Storage::kCompact && !options.size && !options.ratio &&
         !options.onlyFits;
}

/// Adds a grid at its place in the input.
void insertCarried(const NotFitted& left, CarriedGrid grid, RunRecord& record,
                   std::vector<CarriedGrid>& carried) {
  const auto at =
      std::ranges::lower_bound(carried, grid.place, {}, &CarriedGrid::place) - carried.begin();
  record.carried.insert(record.carried.begin() + at, left);
  carried.insert(carried.begin() + at, std::move(grid));
}

}  // namespace

void collectVectors(RunRecord& record) {
  for (std::size_t g = 0; g < record.grids.size(); ++g)
    if (record.grids[g].id.component == std::size_t{0} && !isComplete(record.grids, g))
      record.grids.resize(g);
  record.vectors = listVectors(record);
}

void carrySmallerVectors(const Options& options, RunRecord& record,
                         std::vector<CarriedGrid>& carried) {
  if (!mayCarry(options)) return;
  const auto vectors = record.vectors;
  for (const ConvertedVector& vector : vectors) {
    const std::size_t place = vector.place;
    const GridSummary& source = record.input.grids[place];
    if (!source.whyNotCarried.empty()) continue;
    auto unchanged = readCarried(options.input, std::span(&place, 1), options.read);
    const std::uint64_t bytes = bytesAddedBy(record, vector);
    if (bytesOfCarried(unchanged) >= bytes) continue;
    const std::string why = "its components would take " + std::to_string(bytes) + " bytes";
    removeVector(place, record);
    insertCarried({source, place, why}, std::move(unchanged.front()), record, carried);
  }
}

void measureVectors(const Options& options, const EsvrFile& file, RunRecord& record) {
  for (ConvertedVector& vector : record.vectors) {
    const VectorGrid source = readVector(options.input, vector.place, options.read);
    const VectorGrid decoded = decodeVector(vector.stored.name, componentsOf(file, vector.stored),
                                            {.memory = options.read.memory});
    vector.metrics =
        compareVectors(source.components, decoded.components, {.box = options.convert.fit.box});
  }
}

}  // namespace esvr::vdb2esvr
