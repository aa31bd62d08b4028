#include "esvr/nano_volume.h"

#include <cstring>
#include <new>

#include "vdb/make_nano.h"
#include "vdb/volume_to_tree.h"

namespace esvr::vdb {
namespace {

constexpr std::align_val_t kAlignment{32};

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

std::size_t bytesOf(const NanoHandle& handle) { return handle.buffer().size(); }

std::shared_ptr<const std::byte[]> copied(const NanoHandle& handle) {
  auto* bytes = static_cast<std::byte*>(::operator new[](bytesOf(handle), kAlignment));
  std::memcpy(bytes, handle.data(), bytesOf(handle));
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
}  // namespace esvr::vdb

namespace esvr {

NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values) {
  vdb::initializeOpenVdb();
  const auto handle = vdb::makeNano(*vdb::asFloats(grid), {values});
  return {values, vdb::copied(handle), vdb::bytesOf(handle), grid.volume.background,
          vdb::leavesOf(grid.volume)};
}

}  // namespace esvr
