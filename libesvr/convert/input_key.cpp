#include <xxhash.h>

#include <cstdint>
#include <vector>

#include "esvr/convert.h"
#include "format/bytes.h"

namespace esvr {
namespace {

template <class Items>
void putHash(format::ByteWriter& out, const Items& items) {
  const XXH128_hash_t hash = XXH3_128bits(items.data(), items.size() * sizeof(items.front()));
  for (const std::uint64_t word : {std::uint64_t(items.size()), hash.low64, hash.high64})
    out.put(word);
}

void putVolume(format::ByteWriter& out, const SparseVolume& volume) {
  for (const auto v : {volume.origin.x, volume.origin.y, volume.origin.z}) out.put(v);
  out.put(volume.background);
  putHash(out, volume.bricks);
  putHash(out, volume.values);
  putHash(out, volume.active);
}

}  // namespace

InputKey keyOf(const ConvertInput& input) {
  format::ByteWriter out;
  // The class decides whether a grid is a narrow band. A lossless goal refuses doubles.
  out.put(std::uint8_t(input.descriptor.gridClass == GridClass::kLevelSet));
  out.put(std::uint8_t(input.descriptor.valueType == ValueType::kDouble));
  putVolume(out, input.source);
  const XXH128_hash_t hash = XXH3_128bits(out.bytes().data(), out.size());
  return {hash.low64, hash.high64};
}

}  // namespace esvr
