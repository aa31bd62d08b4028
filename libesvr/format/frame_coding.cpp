#include "esvr/frame_coding.h"

namespace esvr {

std::vector<std::byte> encodeFrame(const EsvrFile& frame, const EsvrFile*) {
  return encodeEsvr(frame);
}

EsvrFile decodeFrame(std::span<const std::byte> bytes, const std::string& nameForErrors,
                     const ReadLimits& limits, const EsvrFile*) {
  return decodeEsvr(bytes, nameForErrors, limits);
}

bool dependsOnPrevious(std::span<const std::byte>) { return false; }

}  // namespace esvr
