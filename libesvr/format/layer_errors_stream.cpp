#include "format/layer_errors_stream.h"

#include <cmath>

#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {
namespace {

constexpr std::size_t kRecordBytes = 2 * sizeof(float);

}  // namespace

std::vector<std::byte> putLayerErrors(std::span<const LayerError> errors) {
  ByteWriter out;
  for (const LayerError& error : errors) {
    out.put(error.psnrBox);
    out.put(error.maxError);
  }
  return out.take();
}

std::vector<LayerError> getLayerErrors(std::span<const std::byte> content, std::size_t layers,
                                       const std::string& where) {
  ByteReader in(content, where);
  if (content.size() != layers * kRecordBytes)
    in.fail("not a table of " + std::to_string(layers) + " layers");
  std::vector<LayerError> errors(layers);
  for (LayerError& error : errors) {
    error.psnrBox = in.get<float>();
    error.maxError = in.get<float>();
    if (std::isnan(error.psnrBox) || !std::isfinite(error.maxError))
      in.fail("the error of a layer is no number");
  }
  return errors;
}

}  // namespace esvr::format
