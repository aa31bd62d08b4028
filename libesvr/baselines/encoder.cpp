#ifdef ESVR_WITH_ZFP
#include <zfp.h>
#endif

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "baselines/voxels.h"
#include "core/add_seconds.h"
#include "esvr/baseline.h"
#include "esvr/error.h"
#include "esvr/grid.h"

namespace esvr {
namespace {

using baselines::DenseBox;

// ZFP on an array. In a build without ZFP, both functions throw UsageError.

#ifdef ESVR_WITH_ZFP

struct FreeField {
  void operator()(zfp_field* field) const { zfp_field_free(field); }
};
struct CloseStream {
  void operator()(zfp_stream* stream) const { zfp_stream_close(stream); }
};
struct CloseBits {
  void operator()(bitstream* bits) const { stream_close(bits); }
};
using ZfpField = std::unique_ptr<zfp_field, FreeField>;
using ZfpStream = std::unique_ptr<zfp_stream, CloseStream>;
using ZfpBits = std::unique_ptr<bitstream, CloseBits>;

ZfpField fieldOf(DenseBox& dense) {
  const auto [nx, ny, nz] = dense.side();
  return ZfpField(zfp_field_3d(dense.values.data(), zfp_type_float, nx, ny, nz));
}

/// Compresses an array to a ZFP stream with a header.
/// \param grid  name of the array's grid, for messages
/// \throws UsageError  the precision is out of range, the box has more than 65,536 voxels along an
///                     axis, or the build has no ZFP
std::vector<std::byte> compressZfp(const DenseBox& dense, const ZfpSetting& setting,
                                   const std::string& grid) {
  DenseBox& source = const_cast<DenseBox&>(dense);  // ZFP takes no const pointer, but only reads
  const ZfpField field = fieldOf(source);
  const ZfpStream stream(zfp_stream_open(nullptr));
  if (setting.mode == ZfpMode::kAccuracy) {
    zfp_stream_set_accuracy(stream.get(), setting.amount);
  } else {
    const auto planes = unsigned(setting.amount);
    if (double(planes) != setting.amount || planes < 1 || planes > kMaxZfpPlanes)
      throw UsageError("zfp: precision must be a whole number from 1 to " +
                       std::to_string(kMaxZfpPlanes));
    zfp_stream_set_precision(stream.get(), planes);
  }
  std::vector<std::byte> bytes(zfp_stream_maximum_size(stream.get(), field.get()));
  const ZfpBits bits(stream_open(bytes.data(), bytes.size()));
  zfp_stream_set_bit_stream(stream.get(), bits.get());
  zfp_stream_rewind(stream.get());
  if (zfp_write_header(stream.get(), field.get(), ZFP_HEADER_FULL) == 0)
    throw UsageError("grid '" + shownName(grid) + "': ZFP has no array of this size");
  const std::size_t size = zfp_compress(stream.get(), field.get());
  if (size == 0)
    throw RuntimeFailure("grid '" + shownName(grid) + "': ZFP failed to compress its voxels");
  bytes.resize(size);
  return bytes;
}

/// Decompresses a stream to an array of the same box.
/// \param file  name of the stream's file, for messages
/// \throws BadInput  the stream does not belong to such an array
void decompressZfp(std::span<const std::byte> bytes, const std::filesystem::path& file,
                   DenseBox& dense) {
  const ZfpField field = fieldOf(dense);
  const ZfpStream stream(zfp_stream_open(nullptr));
  const ZfpBits bits(stream_open(const_cast<std::byte*>(bytes.data()), bytes.size()));
  zfp_stream_set_bit_stream(stream.get(), bits.get());
  zfp_stream_rewind(stream.get());
  const bool read = zfp_read_header(stream.get(), field.get(), ZFP_HEADER_FULL) != 0 &&
                    zfp_field_size(field.get(), nullptr) == dense.values.size() &&
                    zfp_decompress(stream.get(), field.get()) != 0;
  if (!read) throw BadInput(file.string() + ": the ZFP stream does not belong to this box");
}

#else

[[noreturn]] void refuseZfp() {
  throw UsageError("this build has no ZFP (libzfp-dev was not found)");
}
std::vector<std::byte> compressZfp(const DenseBox&, const ZfpSetting&, const std::string&) {
  refuseZfp();
}
void decompressZfp(std::span<const std::byte>, const std::filesystem::path&, DenseBox&) {
  refuseZfp();
}

#endif

void writeStream(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  stream.close();
  if (!stream) throw RuntimeFailure("cannot write " + path.string());
}

std::vector<std::byte> readStream(const std::filesystem::path& path) {
  std::vector<std::byte> bytes(std::filesystem::file_size(path));
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
  if (!stream) throw RuntimeFailure("cannot read " + path.string());
  return bytes;
}

}  // namespace

std::string zfpVersion() {
#ifdef ESVR_WITH_ZFP
  return "ZFP " + std::to_string(ZFP_VERSION_MAJOR) + "." + std::to_string(ZFP_VERSION_MINOR) +
         "." + std::to_string(ZFP_VERSION_PATCH);
#else
  return {};
#endif
}

/// Data that several settings share: the OpenVDB grid of the last threshold, and ZFP's array.
/// Each is made when it is first needed.
struct BaselineEncoder::State {
  explicit State(const BaselineSource& s) : source(s) {}

  /// The voxels as an array for ZFP: those of a box, or the bricks side by side.
  struct ZfpArray {
    DenseBox dense;
    bool bricks = false;
  };

  BaselineSource source;
  std::optional<double> packedThreshold;
  std::unique_ptr<VoxelPacker> packer;
  std::optional<ZfpArray> array;
  BaselineSetting last;

  [[nodiscard]] std::filesystem::path file() const {
    const auto* packing = std::get_if<VoxelPacking>(&last.how);
    const char* ending = !packing ? "zfp" : isNanoVdb(packing->form) ? "nvdb" : "vdb";
    return source.folder / (std::string("baseline.") + ending);
  }
  const VoxelPacker& packerOf(double threshold) {
    if (packedThreshold != threshold) {
      packer = threshold > 0.0
                   ? std::make_unique<VoxelPacker>(baselines::withoutVoxels(source.grid, threshold))
                   : std::make_unique<VoxelPacker>(source.grid);
      packedThreshold = threshold;
    }
    return *packer;
  }
  [[nodiscard]] ZfpArray arrayFor(const ZfpSetting& setting) const {
    const SparseVolume& volume = source.grid.volume;
    if (!setting.bricks) return {baselines::densify(volume, source.box, source.maxDenseBytes)};
    const SparseVolume stack = baselines::stackBricks(volume);
    const Box box = baselines::stackShape(stack.brickCount()).box();
    return {baselines::densify(stack, box, source.maxDenseBytes), true};
  }
  double encodeZfp(const ZfpSetting& setting) {
    if (!array || array->bricks != setting.bricks) array = arrayFor(setting);
    return secondsOf([&] {
      std::vector<std::byte> bytes;
      if (array->bricks) bytes = baselines::encodeBricks(source.grid.volume.bricks);
      const auto stream = compressZfp(array->dense, setting, source.grid.descriptor.name);
      bytes.insert(bytes.end(), stream.begin(), stream.end());
      writeStream(file(), bytes);
    });
  }
  struct ZfpVoxels {
    DenseBox dense;
    std::vector<Coord> bricks;  ///< empty for the voxels of a box
  };
  [[nodiscard]] ZfpVoxels emptyVoxels() const {
    return {{array->dense.box, std::vector<float>(array->dense.values.size())}, {}};
  }
  void decodeZfp(ZfpVoxels& into) const {
    const auto all = readStream(file());
    std::span<const std::byte> bytes = all;
    if (array->bricks) into.bricks = baselines::decodeBricks(bytes);
    decompressZfp(bytes, file(), into.dense);
  }
};

BaselineEncoder::BaselineEncoder(const BaselineSource& source)
    : state_(std::make_unique<State>(source)) {}

BaselineEncoder::~BaselineEncoder() {
  std::error_code ignored;
  for (const char* name : {"baseline.zfp", "baseline.nvdb", "baseline.vdb"})
    std::filesystem::remove(state_->source.folder / name, ignored);
}

const BaselineSource& BaselineEncoder::source() const { return state_->source; }

BaselineEncoder::Encoded BaselineEncoder::encode(const BaselineSetting& setting) {
  if (state_->source.cancel && state_->source.cancel->cancelled()) throw Cancelled();
  state_->last = setting;
  Encoded encoded;
  if (const auto* packing = std::get_if<VoxelPacking>(&setting.how))
    encoded.seconds = state_->packerOf(setting.threshold).write(state_->file(), *packing);
  else
    encoded.seconds = state_->encodeZfp(std::get<ZfpSetting>(setting.how));
  encoded.bytes = std::filesystem::file_size(state_->file());
  return encoded;
}

double BaselineEncoder::secondsToDecode() const {
  if (const auto* packing = std::get_if<VoxelPacking>(&state_->last.how))
    return secondsToRead(state_->file(), packing->form);
  auto voxels = state_->emptyVoxels();
  return secondsOf([&] { state_->decodeZfp(voxels); });
}

SparseVolume BaselineEncoder::decode() const {
  if (std::holds_alternative<VoxelPacking>(state_->last.how)) {
    const auto name = inspectVdb(state_->file()).grids.front().uniqueName;
    return readGrid(state_->file(), name, {.allowEmpty = true}).volume;
  }
  auto voxels = state_->emptyVoxels();
  state_->decodeZfp(voxels);
  const SparseVolume& source = state_->source.grid.volume;
  const SparseVolume volume =
      baselines::sparsify(voxels.dense, source.background, activityThreshold(source));
  if (voxels.bricks.empty()) return volume;
  return baselines::unstackBricks(volume, voxels.bricks, source.origin);
}

float activityThreshold(const SparseVolume& volume) {
  float smallest = std::numeric_limits<float>::infinity();
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i) {
      const float difference = std::abs(volume.brickValues(b)[i] - volume.background);
      if (volume.active[b].test(i) && difference > 0.0f) smallest = std::min(smallest, difference);
    }
  return std::isfinite(smallest) ? smallest / 2 : 0.0f;
}

}  // namespace esvr
