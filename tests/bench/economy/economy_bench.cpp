// Measures for docs/economy.md what the parts of a file cost that its grids do not need:
//
//     bench_economy FILE.esvr       prints JSON: for each grid and part, whether the file has it, and
//                                   the bytes and seconds with and without it
//     bench_economy spheres OUT.esvr  writes a file of spheres of one kappa
//
// A part that is left out is forced in, and the voxels must stay the same, bit for bit; otherwise the
// program fails. Of a sequence, the first frame is measured.

#include <algorithm>
#include <bit>
#include <chrono>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/forced_part.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"

namespace esvr::economy {
namespace {

using Json = nlohmann::json;

constexpr int kRuns = 5;  // of which the fastest counts

template <class Work>
double secondsOf(Work work) {
  double best = std::numeric_limits<double>::infinity();
  for (int run = 0; run < kRuns; ++run) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    best = std::min(best, taken.count());
  }
  return best;
}

EsvrFile readFile(const std::string& path) {
  if (!holdsSequence(path)) return readEsvr(path);
  SequenceReader reader(path);
  return reader.read(reader.frames().front().number);
}

bool sameBits(const SparseVolume& a, const SparseVolume& b) {
  const auto bits = [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  };
  return a.origin == b.origin && a.bricks == b.bricks && a.active == b.active &&
         std::ranges::equal(a.values, b.values, bits);
}

/// A file and what a reader makes of one of its grids.
struct Coded {
  std::vector<std::byte> bytes;
  SparseVolume voxels;
  double encode = 0.0, decode = 0.0;  ///< seconds
};

Coded code(const EsvrFile& file, std::size_t grid) {
  Coded coded;
  coded.encode = secondsOf([&] { coded.bytes = encodeEsvr(file); });
  coded.decode = secondsOf(
      [&] { coded.voxels = decodeGrid(decodeEsvr(coded.bytes, "the file").grids[grid]); });
  return coded;
}

Json costsOf(const Coded& without, const Coded& with) {
  return {{"bytes_with", with.bytes.size()},    {"bytes_without", without.bytes.size()},
          {"encode_seconds_with", with.encode}, {"encode_seconds_without", without.encode},
          {"decode_seconds_with", with.decode}, {"decode_seconds_without", without.decode}};
}

Json forced(const EsvrFile& file, std::size_t g, const NamedPart& part, const Coded& plain) {
  EsvrFile larger = file;
  larger.grids[g] = forcedPart(file.grids[g], part.part, plain.voxels);
  const Coded with = code(larger, g);
  if (!sameBits(with.voxels, plain.voxels))
    throw RuntimeFailure("grid '" + file.grids[g].descriptor.name + "' has other voxels with " +
                         part.name);
  return costsOf(plain, with);
}

Json partOf(const EsvrFile& file, std::size_t g, const NamedPart& part, const Coded& plain) {
  const PartState state = stateOf(file.grids[g], part.part);
  Json json{{"part", part.name}, {"stored", state.stored}, {"why", state.why}};
  if (!state.stored && state.why.empty()) json["forced"] = forced(file, g, part, plain);
  return json;
}

Json streamsOf(const StoredGrid& grid) {
  if (grid.quantised.empty()) return nullptr;
  const StreamBytes bytes = streamBytes(grid);
  return {{"positions", bytes.positions},
          {"scales", bytes.scales},
          {"rotations", bytes.rotations},
          {"intensities", bytes.intensities}};
}

Json gridOf(const EsvrFile& file, std::size_t g) {
  const StoredGrid& grid = file.grids[g];
  const Coded plain = code(file, g);
  Json parts = Json::array();
  for (const NamedPart& part : allParts()) parts.push_back(partOf(file, g, part, plain));
  return {{"name", grid.descriptor.name},
          {"ellipsoids", grid.field.ellipsoidCount()},
          {"voxels", grid.voxels.has_value()},
          {"clamped", grid.field.ellipsoidCount() > 0 && grid.withinRange},
          {"streams", streamsOf(grid)},
          {"bytes", bytesAdded(file, g)},
          {"parts", parts}};
}

/// What the grids share, or null for a single grid. The same voxels are coded without references and
/// with a row of the section table for each section.
Json sharingOf(const EsvrFile& file) {
  if (file.grids.size() < 2) return nullptr;
  EsvrFile apart = file;
  apart.layout = FileLayout::kPlain;
  for (StoredGrid& grid : apart.grids) grid.reference.reset();
  return {{"bytes_with", encodeEsvr(file).size()}, {"bytes_without", encodeEsvr(apart).size()}};
}

void measure(const std::string& path) {
  const EsvrFile file = readFile(path);
  Json grids = Json::array();
  for (std::size_t g = 0; g < file.grids.size(); ++g) grids.push_back(gridOf(file, g));
  std::cout << Json{{"bytes", encodeEsvr(file).size()},
                    {"carried", file.carried.size()},
                    {"grids", grids},
                    {"sharing", sharingOf(file)}}
                   .dump(1)
            << '\n';
}

/// Spheres on a lattice, of one kappa and of positive intensities.
Field spheres() {
  constexpr int kAlong = 10;          // spheres along an edge
  constexpr float kDistance = 12.0f;  // of their centers, voxels
  constexpr float kLogScale = 1.25f;
  Field field;
  Ellipsoids& e = field.chunks.emplace_back().ellipsoids;
  e.resize(std::size_t(kAlong) * kAlong * kAlong);
  for (std::size_t i = 0; i < e.size(); ++i) {
    const std::size_t place[] = {i / (kAlong * kAlong), i / kAlong % kAlong, i % kAlong};
    for (std::size_t a = 0; a < 3; ++a) {
      e.center[a][i] = kDistance * float(place[a] + 1);
      e.logScale[a][i] = kLogScale;
    }
    e.rotation[0][i] = 1.0f;
    e.intensity[i] = 1.0f + float(i % kAlong) / kAlong;
  }
  return field;
}

void writeSpheres(const std::string& path) {
  const Field field = spheres();
  std::vector<Coord> bricks;
  constexpr int kBricks = 17;  // along an edge; they contain all supports
  for (int n = 0; n < kBricks * kBricks * kBricks; ++n)
    bricks.push_back({n / (kBricks * kBricks), n / kBricks % kBricks, n % kBricks});
  SparseVolume source;
  source.bricks = bricks;
  source.values.resize(bricks.size() * kBrickVoxels);
  source.active.resize(bricks.size());
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < source.brickCount(); ++b) corners.push_back(source.brickCorner(b));
  evaluateBricks(field, corners, source.values);
  for (std::size_t v = 0; v < source.values.size(); ++v)
    if (source.values[v] > 0.0f) source.active[v / kBrickVoxels].set(int(v % kBrickVoxels));
  GridDescriptor descriptor;
  descriptor.name = "spheres";
  writeEsvr(path, {{}, {makeStoredGrid(descriptor, source, field, {Activity::kByValue})}},
            {.overwrite = true});
}

}  // namespace
}  // namespace esvr::economy

int main(int argc, char** argv) {
  try {
    if (argc == 2) return esvr::economy::measure(argv[1]), 0;
    if (argc == 3 && std::string(argv[1]) == "spheres")
      return esvr::economy::writeSpheres(argv[2]), 0;
    std::cerr << "usage: bench_economy FILE.esvr, or bench_economy spheres OUT.esvr\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "bench_economy: " << error.what() << '\n';
    return 1;
  }
}
