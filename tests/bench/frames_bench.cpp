/// Compares frames that are predicted from the frame before with files of their own.
///
///     bench_frames GRID PSNR GOP DEVICE FILE...
///
/// The files are those of a sequence, in its order. The grid of each file is converted to voxels of a
/// PSNR (dB) over the box twice, on DEVICE ("cpu", "cuda"): alone, and as a frame of a group of GOP
/// frames of which the first one stands alone. For both ways a line of JSON is printed: the bytes of
/// all files and frames, the least and the mean PSNR of a frame, the PSNR of the change from one frame
/// to the next, of which the peak is that of the frame, and the seconds of the conversions and of
/// encoding.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "esvr/convert.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

struct Settings {
  std::string grid;
  double psnr = 0.0;
  std::size_t framesOfGroup = 1;
  Device device{};
  bool predicted = false;
};

struct Totals {
  std::uint64_t bytes = 0;
  std::size_t dependent = 0;
  double least = HUGE_VAL, sum = 0.0, changes = 0.0, seconds = 0.0, decoding = 0.0;
};

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The sum of the squared difference of two changes over the box, divided by the voxels of the box
/// and by the squared peak.
double changeError(const SparseVolume& before, const SparseVolume& after,
                   const SparseVolume& decodedBefore, const SparseVolume& decodedAfter) {
  Box box = activeBox(before);
  box.expand(activeBox(after));
  double sum = 0.0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
        const Coord at{x, y, z};
        const double change = double(valueAt(after, at)) - valueAt(before, at);
        const double decoded = double(valueAt(decodedAfter, at)) - valueAt(decodedBefore, at);
        sum += (change - decoded) * (change - decoded);
      }
  const double peak = peakOf(after);
  return sum / box.volume() / (peak * peak);
}

/// The frames of a sequence, each of which may refer to the one before.
class Run {
 public:
  explicit Run(const Settings& settings) : settings_(settings) {}

  void add(const VolumeGrid& source, std::size_t number) {
    const bool alone = !settings_.predicted || number % settings_.framesOfGroup == 0;
    const auto start = std::chrono::steady_clock::now();
    const EsvrFile* previous = alone ? nullptr : &before_;
    ConvertOptions options{.goal = PsnrGoal{settings_.psnr},
                           .representation = Representation::kVoxels,
                           .fit = {},
                           .storage = {},
                           .previous = previous ? &previous->grids.front() : nullptr};
    options.fit.device = settings_.device;
    const EsvrFile file{{}, {convertVolume({source.descriptor, source.volume}, options).grid}};
    const auto bytes = encodeFrame(file, previous);
    totals_.seconds += secondsSince(start);
    const auto decoding = std::chrono::steady_clock::now();
    EsvrFile decoded = decodeFrame(bytes, "frame", {}, previous);
    totals_.decoding += secondsSince(decoding);
    totals_.dependent += dependsOnPrevious(bytes);
    totals_.bytes += bytes.size();
    measure(source.volume, decodeGrid(decoded.grids.front()));
    before_ = std::move(decoded);
  }

  [[nodiscard]] Totals totals() const { return totals_; }

 private:
  void measure(const SparseVolume& source, SparseVolume decoded) {
    const double now = psnrOverBox(source, decoded);
    totals_.least = std::min(totals_.least, now);
    totals_.sum += now;
    if (!source_.bricks.empty()) totals_.changes += changeError(source_, source, decoded_, decoded);
    source_ = source;
    decoded_ = std::move(decoded);
  }

  Settings settings_;
  Totals totals_;
  EsvrFile before_;
  SparseVolume source_, decoded_;
};

void print(const char* name, const Totals& totals, std::size_t frames) {
  std::cout << "{\"frames\": \"" << name << "\", \"bytes\": " << totals.bytes
            << ", \"dependent\": " << totals.dependent << ", \"least\": " << totals.least
            << ", \"mean\": " << totals.sum / double(frames)
            << ", \"change\": " << psnr(totals.changes / double(frames - 1), 1.0)
            << ", \"seconds\": " << totals.seconds << ", \"decoding\": " << totals.decoding
            << "}\n";
}

void compare(Settings settings, const std::vector<std::string>& files) {
  Run alone(settings);
  settings.predicted = true;
  Run predicted(settings);
  for (std::size_t f = 0; f < files.size(); ++f) {
    const VolumeGrid source = readGrid(files[f], settings.grid);
    alone.add(source, f);
    predicted.add(source, f);
  }
  print("alone", alone.totals(), files.size());
  print("predicted", predicted.totals(), files.size());
}

}  // namespace
}  // namespace esvr

int main(int count, char** arguments) try {
  if (count < 7) {
    std::cerr << "usage: bench_frames GRID PSNR GOP DEVICE FILE FILE...\n";
    return EXIT_FAILURE;
  }
  const auto framesOfGroup = std::size_t(std::max(std::atoi(arguments[3]), 1));
  esvr::compare({arguments[1], std::atof(arguments[2]), framesOfGroup,
                 esvr::selectDevice(arguments[4])},
                {arguments + 5, arguments + count});
  return EXIT_SUCCESS;
} catch (const esvr::Error& error) {
  std::cerr << "bench_frames: " << error.what() << "\n";
  return EXIT_FAILURE;
}
