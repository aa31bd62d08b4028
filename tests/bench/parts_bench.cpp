// Counts what a reader of a box of a file needs, for docs/benchmarks.md ("Parts of a file"):
//
//     bench_parts FILE.esvr X0,Y0,Z0,X1,Y1,Z1...
//
// The program prints a line for each box: the ellipsoids whose support meets it, and the ellipsoids
// and bytes of the blocks that have at least one of them. Only grids with layers have blocks that
// can be read alone; others are left out.

#include <cstdio>
#include <exception>
#include <numeric>
#include <vector>

#include "cli/box_option.h"
#include "esvr/container.h"
#include "format/ellipsoid_block.h"

namespace {

using namespace esvr;

struct Needed {
  std::size_t reaching = 0, inBlocks = 0, bytes = 0;
};

bool meet(const Box& a, const Box& b) {
  const Coord low = maxCoord(a.min, b.min), high = minCoord(a.max, b.max);
  return low.x <= high.x && low.y <= high.y && low.z <= high.z;
}

std::size_t bytesOf(const format::BlockStreams& block) {
  return std::accumulate(block.begin(), block.end(), std::size_t{0},
                         [](std::size_t sum, const auto& stream) { return sum + stream.size(); });
}

void add(const Chunk& chunk, QuantisedEllipsoids q, const Kernel& kernel, const Box& box,
         Needed& needed) {
  for (const format::Run block : format::blockRuns(q)) {
    std::size_t reaching = 0;
    for (std::size_t i = block.first; i < block.first + block.count; ++i)
      reaching += meet(format::supportBox(chunk, {i, 1}, kernel), box);
    if (reaching == 0) continue;
    needed.reaching += reaching;
    needed.inBlocks += block.count;
    needed.bytes += bytesOf(format::encodeBlock(q, block));
  }
}

Needed neededFor(const Box& box, const EsvrFile& file) {
  Needed needed;
  for (const StoredGrid& grid : file.grids)
    for (std::size_t c = 0; c < grid.quantised.size(); ++c)
      if (!grid.quantised[c].layerEnds.empty())
        add(grid.field.chunks[c], grid.quantised[c], grid.field.kernel, box, needed);
  return needed;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::fputs("usage: bench_parts FILE.esvr X0,Y0,Z0,X1,Y1,Z1...\n", stderr);
    return 2;
  }
  const EsvrFile file = readEsvr(argv[1]);
  for (int b = 2; b < argc; ++b) {
    const Needed needed = neededFor(cli::parseBox(argv[b]), file);
    std::printf("%s: %zu ellipsoids reach the box; their blocks have %zu ellipsoids in %zu bytes\n",
                argv[b], needed.reaching, needed.inBlocks, needed.bytes);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_parts: %s\n", error.what());
  return 1;
}
