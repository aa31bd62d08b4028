#include <algorithm>
#include <numeric>

#include "esvr/container.h"
#include "format/ellipsoid_block.h"

namespace esvr {
namespace {

std::size_t layersOf(const QuantisedEllipsoids& q) {
  return q.layerEnds.empty() ? std::min<std::size_t>(q.size(), 1) : q.layerEnds.size();
}

std::uint64_t bytesOf(const format::BlockStreams& block) {
  return std::accumulate(block.begin(), block.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const auto& s) { return sum + s.size(); });
}

void addLayers(const QuantisedEllipsoids& q, std::vector<LayerSize>& sizes) {
  const auto runs = format::blockRuns(q);
  const auto blocks = format::encodeBlocks(q);
  std::size_t layer = 0;
  for (std::size_t b = 0; b < runs.size(); ++b) {
    if (!q.layerEnds.empty() && runs[b].first == q.layerEnds[layer]) ++layer;
    sizes[layer].ellipsoids += runs[b].count;
    sizes[layer].bytes += bytesOf(blocks[b]);
  }
}

}  // namespace

std::size_t layerCount(const StoredGrid& grid) {
  if (grid.quantised.empty()) return std::min<std::size_t>(grid.field.ellipsoidCount(), 1);
  std::size_t layers = 0;
  for (const auto& chunk : grid.quantised) layers = std::max(layers, layersOf(chunk));
  return layers;
}

std::vector<LayerSize> layerSizes(const StoredGrid& grid) {
  std::vector<LayerSize> sizes(grid.quantised.empty() ? 0 : layerCount(grid));
  for (const auto& chunk : grid.quantised) addLayers(chunk, sizes);
  return sizes;
}

StreamBytes streamBytes(const StoredGrid& grid) {
  StreamBytes bytes;
  for (const auto& chunk : grid.quantised) {
    for (const auto& block : format::encodeBlocks(chunk)) {
      bytes.positions += block[0].size();
      bytes.scales += block[1].size();
      bytes.rotations += block[2].size();
      bytes.intensities += block[3].size();
    }
  }
  return bytes;
}

}  // namespace esvr
