#include "esvr/nano_volume.h"

#include "vdb/versions.h"

#define NANOVDB_USE_OPENVDB
#include ESVR_NANOVDB_CREATE

#include <cstring>
#include <new>
#include <stdexcept>

#include "vdb/volume_to_tree.h"

namespace esvr {
namespace {

using Handle = nanovdb::GridHandle<nanovdb::HostBuffer>;
constexpr std::align_val_t kAlignment{32};

template <class Build>
Handle converted(const openvdb::FloatGrid& grid) {
#ifdef ESVR_NANOVDB_HAS_CREATE
  return vdb::nanotools::createNanoGrid<openvdb::FloatGrid, Build>(grid);
#else
  nanovdb::OpenToNanoVDB<float, Build> convert;
  convert.enableDithering(false);
  return convert(grid);
#endif
}

Handle converted(const openvdb::FloatGrid& grid, NanoValues values) {
  switch (values) {
    case NanoValues::kFloat:
      return converted<float>(grid);
    case NanoValues::kFp4:
      return converted<nanovdb::Fp4>(grid);
    case NanoValues::kFp8:
      return converted<nanovdb::Fp8>(grid);
    case NanoValues::kFp16:
      return converted<nanovdb::Fp16>(grid);
    case NanoValues::kFpN:
      return converted<nanovdb::FpN>(grid);
  }
  throw std::logic_error("makeNanoVolume: no such values");
}

/// Every brick a leaf of floats, and no tiles, whose values a renderer would have to know.
openvdb::FloatGrid::Ptr asFloats(const VolumeGrid& from) {
  VolumeGrid grid = from;
  grid.descriptor.valueType = ValueType::kFloat;
  grid.descriptor.gridClass = GridClass::kFogVolume;
  WriteOptions options;
  options.half = HalfMode::kOff;
  options.constantTiles = false;
  return openvdb::gridPtrCast<openvdb::FloatGrid>(vdb::makeOpenVdbGrid(grid, options));
}

std::shared_ptr<const std::byte[]> copied(const Handle& handle) {
  auto* bytes = static_cast<std::byte*>(::operator new[](handle.size(), kAlignment));
  std::memcpy(bytes, handle.data(), handle.size());
  return {bytes,
          [](const std::byte* p) { ::operator delete[](const_cast<std::byte*>(p), kAlignment); }};
}

Box leavesOf(const SparseVolume& volume) {
  Box box;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    box.expand(volume.brickCorner(b));
    box.expand(volume.brickCorner(b) + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1});
  }
  return box;
}

}  // namespace

NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values) {
  vdb::initializeOpenVdb();
  const Handle handle = converted(*asFloats(grid), values);
  return {values, copied(handle), handle.size(), grid.volume.background, leavesOf(grid.volume)};
}

}  // namespace esvr
