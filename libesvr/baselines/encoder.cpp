#include <fstream>
#include <optional>
#include <span>
#include <utility>

#include "baselines/brick_stack.h"
#include "baselines/dense_box.h"
#include "baselines/drop_voxels.h"
#include "baselines/zfp_codec.h"
#include "core/add_seconds.h"
#include "esvr/baseline.h"
#include "esvr/error.h"

namespace esvr {
namespace {

using baselines::DenseBox;

void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  stream.close();
  if (!stream) throw RuntimeFailure("cannot write " + path.string());
}

std::vector<std::byte> readBytes(const std::filesystem::path& path) {
  std::vector<std::byte> bytes(std::filesystem::file_size(path));
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size()));
  if (!stream) throw RuntimeFailure("cannot read " + path.string());
  return bytes;
}

}  // namespace

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
      const auto stream =
          baselines::compressZfp(array->dense, setting, source.grid.descriptor.name);
      bytes.insert(bytes.end(), stream.begin(), stream.end());
      writeBytes(file(), bytes);
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
    const auto all = readBytes(file());
    std::span<const std::byte> bytes = all;
    if (array->bricks) into.bricks = baselines::decodeBricks(bytes);
    baselines::decompressZfp(bytes, file(), into.dense);
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
      baselines::sparsify(voxels.dense, source.background, baselines::activityThreshold(source));
  if (voxels.bricks.empty()) return volume;
  return baselines::unstackBricks(volume, voxels.bricks, source.origin);
}

}  // namespace esvr
