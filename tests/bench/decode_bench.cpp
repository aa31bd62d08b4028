/// Measures how fast the voxels of .esvr files are decoded.
///
///     bench_decode RUNS FILE...
///
/// For each file it prints a line of JSON: the active voxels, all voxels of the bricks, and the
/// median seconds of two steps. `read` opens the file and decodes its entropy-coded sections;
/// `values` turns the codes into floats.

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <vector>

#include "esvr/container.h"
#include "esvr/grid_coding.h"

namespace esvr {
namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double median(std::vector<double> seconds) {
  const auto middle = seconds.begin() + std::ptrdiff_t(seconds.size() / 2);
  std::nth_element(seconds.begin(), middle, seconds.end());
  return *middle;
}

struct Decoding {
  std::uint64_t active = 0, voxels = 0;
  double read = 0.0, values = 0.0;
};

Decoding decode(const char* path) {
  Decoding result;
  auto start = Clock::now();
  const EsvrFile file = readEsvr(path);
  result.read = secondsSince(start);
  for (const StoredGrid& grid : file.grids) {
    start = Clock::now();
    const SparseVolume volume = decodeGrid(grid);
    result.values += secondsSince(start);
    result.active += activeVoxelCount(volume);
    result.voxels += volume.values.size();
  }
  return result;
}

void printMedians(const char* path, int runs) {
  std::vector<double> read, values;
  Decoding last;
  for (int run = 0; run < runs; ++run) {
    last = decode(path);
    read.push_back(last.read);
    values.push_back(last.values);
  }
  std::cout << "{\"active\": " << last.active << ", \"voxels\": " << last.voxels
            << ", \"read\": " << median(read) << ", \"values\": " << median(values) << "}\n";
}

}  // namespace
}  // namespace esvr

int main(int count, char** arguments) {
  if (count < 3) return std::cerr << "usage: bench_decode RUNS FILE...\n", EXIT_FAILURE;
  const int runs = std::max(std::atoi(arguments[1]), 1);
  for (int k = 2; k < count; ++k) esvr::printMedians(arguments[k], runs);
}
