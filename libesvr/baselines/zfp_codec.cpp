#include "baselines/zfp_codec.h"

#include <zfp.h>

#include <memory>
#include <string>

#include "esvr/error.h"
#include "esvr/grid_names.h"

namespace esvr {
namespace {

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

ZfpField fieldOf(baselines::DenseBox& dense) {
  const auto [nx, ny, nz] = dense.side();
  return ZfpField(zfp_field_3d(dense.values.data(), zfp_type_float, nx, ny, nz));
}

void apply(const ZfpSetting& setting, zfp_stream* stream) {
  if (setting.mode == ZfpMode::kAccuracy) {
    zfp_stream_set_accuracy(stream, setting.amount);
    return;
  }
  const auto planes = unsigned(setting.amount);
  if (double(planes) != setting.amount || planes < 1 || planes > baselines::kMaxZfpPlanes)
    throw UsageError("zfp: precision must be a whole number from 1 to " +
                     std::to_string(baselines::kMaxZfpPlanes));
  zfp_stream_set_precision(stream, planes);
}

}  // namespace

std::string zfpVersion() {
  return "ZFP " + std::to_string(ZFP_VERSION_MAJOR) + "." + std::to_string(ZFP_VERSION_MINOR) +
         "." + std::to_string(ZFP_VERSION_PATCH);
}

namespace baselines {

std::vector<std::byte> compressZfp(const DenseBox& dense, const ZfpSetting& setting,
                                   const std::string& grid) {
  DenseBox& source = const_cast<DenseBox&>(dense);  // ZFP takes no const pointer, but only reads
  const ZfpField field = fieldOf(source);
  const ZfpStream stream(zfp_stream_open(nullptr));
  apply(setting, stream.get());
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

}  // namespace baselines
}  // namespace esvr
