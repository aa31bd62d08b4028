#include "vdb/write_nvdb.h"

#include <cstring>
#include <deque>
#include <fstream>
#include <new>
#include <stdexcept>
#include <type_traits>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "vdb/write_vdb.h"

#include ESVR_NANOVDB_CREATE

namespace esvr::vdb {
namespace {

// Grids

#ifdef ESVR_NANOVDB_HAS_CREATE
template <class Build, class Grid>
NanoHandle converted(const Grid& grid, float tolerance) {
  nanotools::CreateNanoGrid<Grid> create(grid);
  if constexpr (std::is_same_v<Build, nanovdb::FpN>)
    return create.template getHandle<Build>(nanotools::AbsDiff(tolerance));
  else
    return create.template getHandle<Build>();
}
#else
template <class Build, class Grid>
NanoHandle converted(const Grid& grid, float tolerance) {
  nanovdb::OpenToNanoVDB<typename Grid::ValueType, Build> create;
  if constexpr (std::is_same_v<Build, nanovdb::FpN>) create.oracle() = nanovdb::AbsDiff(tolerance);
  return create(grid);
}
#endif

NanoHandle makeNano(const openvdb::FloatGrid& grid, const NanoForm& form) {
  switch (form.values) {
    case NanoValues::kFloat:
      return converted<float>(grid, form.tolerance);
    case NanoValues::kFp4:
      return converted<nanovdb::Fp4>(grid, form.tolerance);
    case NanoValues::kFp8:
      return converted<nanovdb::Fp8>(grid, form.tolerance);
    case NanoValues::kFp16:
      return converted<nanovdb::Fp16>(grid, form.tolerance);
    case NanoValues::kFpN:
      return converted<nanovdb::FpN>(grid, form.tolerance);
  }
  throw std::logic_error("makeNano: no such values");
}

// Grids for renderers

constexpr std::align_val_t kNanoAlignment{32};

/// Makes a grid of floats in which every brick is a leaf, without tiles, so that a renderer need
/// not handle tiles.
openvdb::GridBase::Ptr asFloats(const VolumeGrid& from) {
  VolumeGrid grid = from;
  grid.descriptor.valueType = ValueType::kFloat;
  grid.descriptor.gridClass = GridClass::kFogVolume;
  WriteOptions options;
  options.half = HalfMode::kOff;
  options.constantTiles = false;
  return makeOpenVdbGrid(grid, options);
}

std::shared_ptr<const std::byte[]> copied(const NanoHandle& handle) {
  const std::size_t size = handle.buffer().size();
  auto* bytes = static_cast<std::byte*>(::operator new[](size, kNanoAlignment));
  std::memcpy(bytes, handle.data(), size);
  return {bytes, [](const std::byte* p) {
            ::operator delete[](const_cast<std::byte*>(p), kNanoAlignment);
          }};
}

Box leavesOf(const SparseVolume& volume) {
  Box box;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    box.expand(volume.brickCorner(b));
    box.expand(volume.brickCorner(b) + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1});
  }
  return box;
}

// Files

void refuseWhatNanoVdbLacks(const VolumeGrid& grid, const WriteOptions& options) {
  const std::string name = "grid \"" + shownName(grid.descriptor.name) + "\": ";
  if (options.half == HalfMode::kOn)
    throw UsageError(name + ".nvdb files are not written as half; ask for .vdb");
  if (!grid.descriptor.transform.affine)
    throw UsageError(name + "a .nvdb holds affine transforms only, this one is a " +
                     grid.descriptor.transform.mapType + "; ask for .vdb");
}

VolumeGrid unpackedGrid(const PackedGrid& grid) {
  const auto* voxels = std::get_if<PackedVoxels<float>>(&grid.voxels);
  if (!voxels)
    throw UsageError("grid \"" + shownName(grid.descriptor.name) + "\" has values of type " +
                     valueTypeOf(grid) + ", which are not written to .nvdb files; ask for .vdb");
  VolumeGrid volume{grid.descriptor, unpacked(*voxels)};
  volume.descriptor.background = double(voxels->background);
  return volume;
}

/// \param unpackedGrids  gets the volumes of packed grids
std::vector<const VolumeGrid*> volumesOf(std::span<const GridToWrite> grids,
                                         std::deque<VolumeGrid>& unpackedGrids) {
  std::vector<const VolumeGrid*> volumes;
  for (const auto& grid : grids) {
    if (const auto* carried = std::get_if<const CarriedGrid*>(&grid))
      throw UsageError("grid \"" + shownName((*carried)->name) + "\" (" +
                       shownName((*carried)->treeType) +
                       ") is carried unchanged, which a .nvdb file cannot hold; ask for .vdb");
    if (const auto* vectors = std::get_if<const VectorGrid*>(&grid))
      throw UsageError("grid \"" + shownName((*vectors)->descriptor.name) +
                       "\" has vectors, which are not written to .nvdb files; ask for .vdb");
    if (const auto* packed = std::get_if<const PackedGrid*>(&grid))
      volumes.push_back(&unpackedGrids.emplace_back(unpackedGrid(**packed)));
    else
      volumes.push_back(std::get<const VolumeGrid*>(grid));
  }
  return volumes;
}

}  // namespace

NanoHandle makeNano(const openvdb::GridBase& grid, const NanoForm& form) {
  if (grid.isType<openvdb::FloatGrid>())
    return makeNano(static_cast<const openvdb::FloatGrid&>(grid), form);
  if (grid.isType<openvdb::DoubleGrid>() && form.values == NanoValues::kFloat)
    return converted<double>(static_cast<const openvdb::DoubleGrid&>(grid), form.tolerance);
  throw std::logic_error("makeNano: a grid of " + grid.valueType());
}

void writeNanoVdb(const std::filesystem::path& path, std::span<const GridToWrite> grids,
                  const WriteOptions& options) {
  if (grids.empty()) throw BadInput("a .nvdb file cannot be written without a grid; ask for .vdb");
  std::deque<VolumeGrid> unpackedGrids;
  const auto volumes = volumesOf(grids, unpackedGrids);
  for (const VolumeGrid* grid : volumes) refuseWhatNanoVdbLacks(*grid, options);
  WriteOptions whole = options;
  whole.half = HalfMode::kOff;
  std::vector<NanoHandle> handles;
  for (const VolumeGrid* grid : volumes)
    handles.push_back(makeNano(*makeOpenVdbGrid(*grid, whole)));

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  nanovdb::io::writeGrids(stream, handles, nanovdb::io::Codec::ZIP);
  stream.close();
}

}  // namespace esvr::vdb

namespace esvr {

NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values) {
  vdb::initializeOpenVdb();
  const auto handle = vdb::makeNano(*vdb::asFloats(grid), {values});
  return {values, vdb::copied(handle), handle.buffer().size(), grid.volume.background,
          vdb::leavesOf(grid.volume)};
}

}  // namespace esvr
