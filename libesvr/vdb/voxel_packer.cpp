#include "esvr/vdb_io.h"

#include "vdb/open_vdb.h"

#include <openvdb/io/Archive.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/add_seconds.h"
#include "esvr/error.h"
#include "vdb/files.h"
#include "vdb/formats.h"
#include "vdb/write_nvdb.h"

namespace esvr::vdb {
namespace {

nanovdb::io::Codec nanoCodec(PackedCodec codec) {
  switch (codec) {
    case PackedCodec::kZip:
      return nanovdb::io::Codec::ZIP;
    case PackedCodec::kBlosc:
      return nanovdb::io::Codec::BLOSC;
    case PackedCodec::kNone:
      break;
  }
  return nanovdb::io::Codec::NONE;
}

std::uint32_t openVdbFlags(PackedCodec codec) {
  using namespace openvdb::io;
  switch (codec) {
    case PackedCodec::kZip:
      return COMPRESS_ACTIVE_MASK | COMPRESS_ZIP;
    case PackedCodec::kBlosc:
      return COMPRESS_ACTIVE_MASK | COMPRESS_BLOSC;
    case PackedCodec::kNone:
      break;
  }
  return COMPRESS_ACTIVE_MASK;
}

void checkPacking(const VoxelPacking& packing, const GridDescriptor& descriptor) {
  if (packing.form == PackedForm::kNanoFpN && !(packing.tolerance > 0.0))
    throw UsageError("FpN needs a tolerance above 0");
  if (isNanoVdb(packing.form) && !descriptor.transform.affine)
    throw UsageError("NanoVDB holds affine transforms only, not a " + descriptor.transform.mapType);
}

constexpr float kLargestHalf = 65504.0f;

bool fitsHalf(const SparseVolume& volume) {
  if (volume.brickCount() == 0) return true;
  const ValueRange range = activeRange(volume);
  return std::max({std::abs(range.min), std::abs(range.max), std::abs(volume.background)}) <=
         kLargestHalf;
}

openvdb::FloatGrid::Ptr makeFloatGrid(VolumeGrid grid) {
  grid.descriptor.valueType = ValueType::kFloat;  // that of the volume, even for a double source
  return openvdb::gridPtrCast<openvdb::FloatGrid>(makeOpenVdbGrid(grid, {.half = HalfMode::kOff}));
}

/// OpenVDB's own class File ignores the errors of the stream that it writes to. This class writes to a
/// stream that throws.
class StreamArchive : public openvdb::io::Archive {
 public:
  explicit StreamArchive(std::uint32_t flags) { setCompression(flags); }

  void writeTo(std::ostream& stream, const openvdb::GridPtrVec& grids) const {
    constexpr bool kSeekable = true;
    Archive::write(stream, grids, kSeekable, openvdb::MetaMap());
  }
};

void writePacked(openvdb::FloatGrid& source, const VoxelPacking& packing, std::ostream& stream) {
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(source.copyGrid());  // shares the tree
  grid->setSaveFloatAsHalf(packing.form == PackedForm::kOpenVdbHalf);
  if (packing.codec == PackedCodec::kZip) grid->setGridClass(openvdb::GRID_UNKNOWN);
  StreamArchive(openVdbFlags(packing.codec)).writeTo(stream, {grid});
}

void writeNano(const openvdb::FloatGrid& source, const VoxelPacking& packing,
               std::ostream& stream) {
  const auto handle = makeNano(source, {nanoValues(packing.form), float(packing.tolerance)});
  nanovdb::io::writeGrid(stream, handle, nanoCodec(packing.codec));
}

void writeForm(const openvdb::FloatGrid::Ptr& grid, const VoxelPacking& packing,
               const std::filesystem::path& path) {
  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  if (isNanoVdb(packing.form))
    writeNano(*grid, packing, stream);
  else
    writePacked(*grid, packing, stream);
  stream.close();
}

}  // namespace
}  // namespace esvr::vdb

namespace esvr {

bool isNanoVdb(PackedForm form) {
  return form != PackedForm::kOpenVdbFloat && form != PackedForm::kOpenVdbHalf;
}

NanoValues nanoValues(PackedForm form) {
  switch (form) {
    case PackedForm::kNanoFp16:
      return NanoValues::kFp16;
    case PackedForm::kNanoFp8:
      return NanoValues::kFp8;
    case PackedForm::kNanoFp4:
      return NanoValues::kFp4;
    case PackedForm::kNanoFpN:
      return NanoValues::kFpN;
    default:
      return NanoValues::kFloat;
  }
}

/// OpenVDB's grid, and what a file of it may be.
struct VoxelPacker::Source {
  openvdb::FloatGrid::Ptr grid;
  GridDescriptor descriptor;
  bool fitsHalf;
};

VoxelPacker::VoxelPacker(const VolumeGrid& grid)
    : source_(new Source{vdb::makeFloatGrid(grid), grid.descriptor, vdb::fitsHalf(grid.volume)}) {}

VoxelPacker::~VoxelPacker() = default;

double VoxelPacker::write(const std::filesystem::path& path, const VoxelPacking& packing) const {
  vdb::checkPacking(packing, source_->descriptor);
  if (packing.form == PackedForm::kOpenVdbHalf && !source_->fitsHalf)
    throw UsageError("has values beyond 65504, the largest that half precision holds");
  return vdb::whileWriting(
      path, [&] { return secondsOf([&] { vdb::writeForm(source_->grid, packing, path); }); });
}

double secondsToRead(const std::filesystem::path& path, PackedForm form) {
  vdb::initializeOpenVdb();
  return vdb::whileReading(path, [&] {
    return secondsOf([&] {
      if (isNanoVdb(form)) {
        (void)nanovdb::io::readGrid(path.string());
        return;
      }
      constexpr bool kDelayLoad = false;
      openvdb::io::File file(path.string());
      file.open(kDelayLoad);
      (void)file.getGrids();
    });
  });
}

}  // namespace esvr
