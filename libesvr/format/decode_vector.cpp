#include <algorithm>

#include "esvr/grid_coding.h"

namespace esvr {

VectorGrid decodeVector(const std::string& name, StoredComponents components,
                        const DecodeOptions& options) {
  VectorGrid vectors;
  vectors.descriptor = components.front().descriptor;
  vectors.descriptor.name = name;
  DecodeOptions left = options;
  for (std::size_t c = 0; c < kComponents; ++c) {
    vectors.background[c] = components[c].descriptor.background;
    vectors.components[c] = decodeGrid(components[c], left);
    const std::uint64_t bytes = vectors.components[c].values.size() * sizeof(float);
    if (left.maxBytes != kNoMemoryLimit && !left.memory.isInFile(bytes))
      left.maxBytes -= std::min(left.maxBytes, bytes);
  }
  return vectors;
}

}  // namespace esvr
