#include "vdb/write_nvdb.h"

#include <cstring>
#include <deque>
#include <fstream>
#include <new>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <variant>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "vdb/formats.h"

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

NanoHandle floatsToNano(const openvdb::FloatGrid& grid, const NanoForm& form) {
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
  throw std::logic_error("floatsToNano: no such values");
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

/// A grid in the form from which OpenVDB's grid is made.
using Readable = std::variant<const VolumeGrid*, const VectorGrid*>;

std::string whyNotNano(const GridDescriptor& grid) {
  if (grid.transform.affine) return "";
  return "a .nvdb file holds affine transforms only, this one is a " + grid.transform.mapType;
}

std::string whyNotNano(const VolumeGrid& grid) { return whyNotNano(grid.descriptor); }
std::string whyNotNano(const VectorGrid& grid) { return whyNotNano(grid.descriptor); }

std::string whyNotNano(const CarriedGrid& carried) {
  const GridSummary grid = inspectCarried(carried);
  if ((grid.isScalar || grid.isVector) && grid.activeVoxels > 0) return "";
  return "a .nvdb file cannot hold it (" + shownName(carried.treeType) + ", carried unchanged)";
}

std::string whyNotNano(const PackedGrid& grid) {
  const bool isReadable = std::holds_alternative<PackedVoxels<float>>(grid.voxels);
  if (isReadable) return whyNotNano(grid.descriptor);
  return "its values are of type " + valueTypeOf(grid) + ", which are not written to .nvdb files";
}

/// Grids that become others before they are written.
class ReadGrids {
 public:
  Readable read(const GridToWrite& grid) {
    return std::visit([&](const auto* one) { return of(*one); }, grid);
  }

 private:
  static Readable of(const VolumeGrid& grid) { return &grid; }
  /// NanoVDB's converter has no vectors of doubles. The components are floats in any case.
  Readable of(const VectorGrid& grid) {
    if (grid.descriptor.valueType != ValueType::kDouble) return &grid;
    VectorGrid& floats = vectors_.emplace_back(grid);
    floats.descriptor.valueType = ValueType::kFloat;
    return &floats;
  }
  Readable of(const PackedGrid& grid) {
    const auto& voxels = std::get<PackedVoxels<float>>(grid.voxels);
    VolumeGrid volume{grid.descriptor, unpacked(voxels)};
    volume.descriptor.background = double(voxels.background);
    return &volumes_.emplace_back(std::move(volume));
  }
  Readable of(const CarriedGrid& grid) {
    const ReadOptions read{.nonFinite = NonFinite::kKeep};
    if (inspectCarried(grid).isVector) return of(vectors_.emplace_back(readVector(grid, read)));
    return &volumes_.emplace_back(readGrid(grid, read));
  }

  std::deque<VolumeGrid> volumes_;
  std::deque<VectorGrid> vectors_;
};

NanoHandle toNano(const Readable& grid, const WriteOptions& options) {
  const auto* const* vectors = std::get_if<const VectorGrid*>(&grid);
  if (vectors) return makeNano(*makeOpenVdbGrid(**vectors, options, LeafVoxels::kInMemory));
  return makeNano(*makeOpenVdbGrid(*std::get<const VolumeGrid*>(grid), options));
}

std::string nameOf(const CarriedGrid& grid) { return grid.name; }
template <class Grid>
std::string nameOf(const Grid& grid) {
  return grid.descriptor.name;
}

void requireNano(const GridToWrite& grid, const WriteOptions& options) {
  std::string why = esvr::whyNotNano(grid);
  if (why.empty() && options.half == HalfMode::kOn) why = ".nvdb files are not written as half";
  const auto name = std::visit([](const auto* one) { return nameOf(*one); }, grid);
  if (!why.empty()) throw UsageError("grid \"" + shownName(name) + "\": " + why + "; ask for .vdb");
}

}  // namespace

NanoHandle makeNano(const openvdb::GridBase& grid, const NanoForm& form) {
  if (grid.isType<openvdb::FloatGrid>())
    return floatsToNano(static_cast<const openvdb::FloatGrid&>(grid), form);
  if (form.values == NanoValues::kFloat) {
    if (grid.isType<openvdb::DoubleGrid>())
      return converted<double>(static_cast<const openvdb::DoubleGrid&>(grid), form.tolerance);
    if (grid.isType<openvdb::Vec3SGrid>())
      return converted<nanovdb::Vec3f>(static_cast<const openvdb::Vec3SGrid&>(grid), 0.0f);
  }
  throw std::logic_error("makeNano: a grid of " + grid.valueType());
}

void writeNanoVdb(const std::filesystem::path& path, std::span<const GridToWrite> grids,
                  const WriteOptions& options) {
  if (grids.empty()) throw BadInput("a .nvdb file cannot be written without a grid; ask for .vdb");
  forEachNamed(grids, [&](std::size_t g) { requireNano(grids[g], options); });
  WriteOptions whole = options;
  whole.half = HalfMode::kOff;
  std::vector<NanoHandle> handles;
  for (const GridToWrite& grid : grids) {
    ReadGrids made;
    handles.push_back(toNano(made.read(grid), whole));
  }

  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  nanovdb::io::writeGrids(stream, handles, nanovdb::io::Codec::ZIP);
  stream.close();
}

}  // namespace esvr::vdb

namespace esvr {

std::string whyNotNano(const GridToWrite& grid) {
  return std::visit([](const auto* one) { return vdb::whyNotNano(*one); }, grid);
}

NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values) {
  vdb::initializeOpenVdb();
  const auto handle = vdb::makeNano(*vdb::asFloats(grid), {values});
  return {values, vdb::copied(handle), handle.buffer().size(), grid.volume.background,
          vdb::leavesOf(grid.volume)};
}

}  // namespace esvr
