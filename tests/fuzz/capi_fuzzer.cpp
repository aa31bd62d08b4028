// Opens files with corrected checksums by the C interface, and asks for all that it gives: grids,
// ellipsoids, voxels of a box and of the whole grid, and values at places. The first bytes choose
// the box and the places. Whatever the file, a call succeeds or gives a status with a text.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "esvr/esvr.h"
#include "fuzz/repair.h"

namespace {

constexpr std::uint64_t kMaxMemory = std::uint64_t{64} << 20;
constexpr std::size_t kChoiceBytes = 4, kPlaces = 3;
constexpr int kBoxSide = 12;

void require(bool holds) {
  if (!holds) std::abort();
}

/// Whether a call succeeded; a failure must have a text and a status of the interface.
bool succeeded(esvr_status status) {
  if (status == ESVR_OK) return true;
  require(status == ESVR_FAILED || status == ESVR_USAGE || status == ESVR_BAD_INPUT ||
          status == ESVR_MEMORY);
  require(*esvr_error() != '\0');
  return false;
}

std::int32_t coordinate(std::uint8_t choice) { return std::int32_t(choice) - 64; }

/// Places within reach, at the edge of what there is, and where nothing is.
std::vector<double> placesFrom(const std::uint8_t* choice) {
  const double far = choice[3] & 1 ? std::numeric_limits<double>::infinity() : 1e30;
  return {choice[0] / 3.0, choice[1] / 3.0, choice[2] / 3.0, far, 0.0, 0.0, -0.5, 2e9,
          choice[0] + 0.0};
}

/// \param hasGaps  whether values may be NaN
void readVolume(esvr_volume* volume, bool hasGaps, const std::vector<double>& places) {
  for (std::size_t b = 0; b < esvr_brick_count(volume); ++b) {
    esvr_brick brick{};
    require(esvr_get_brick(volume, b, &brick) == ESVR_OK);
    for (std::size_t i = 0; i < ESVR_BRICK_VOXELS; ++i)
      require(hasGaps || !std::isnan(brick.values[i]));
  }
  esvr_brick none{};
  require(esvr_get_brick(volume, esvr_brick_count(volume), &none) == ESVR_USAGE);
  std::vector<float> values(kPlaces);
  (void)succeeded(esvr_sample(volume, kPlaces, places.data(), values.data()));
}

void readEllipsoids(const esvr_file* file, std::size_t grid, std::uint64_t count) {
  if (count == 0) return;
  std::vector<esvr_ellipsoid> all(count);
  require(esvr_get_ellipsoids(file, grid, 0, count, all.data()) == ESVR_OK);
  require(esvr_get_ellipsoids(file, grid, 1, count, all.data()) == ESVR_USAGE);
}

void readGrid(const esvr_file* file, std::size_t grid, const std::uint8_t* choice) {
  esvr_grid description{};
  description.size = sizeof description;
  require(esvr_get_grid(file, grid, &description) == ESVR_OK);
  readEllipsoids(file, grid, description.ellipsoids);

  const std::vector<double> places = placesFrom(choice);
  std::vector<float> at(kPlaces);
  (void)succeeded(esvr_evaluate(file, grid, kPlaces, places.data(), at.data()));

  const std::int32_t x = coordinate(choice[0]), y = coordinate(choice[1]),
                     z = coordinate(choice[2]);
  const std::int32_t box[] = {x, y, z, x + kBoxSide - 1, y + kBoxSide - 1, z + kBoxSide - 1};
  std::vector<float> values(kBoxSide * kBoxSide * kBoxSide);
  std::vector<std::uint8_t> active(values.size());
  (void)succeeded(esvr_decode_box(file, grid, box, kMaxMemory, values.data(), active.data()));

  esvr_volume* volume = nullptr;
  const esvr_status status =
      esvr_decode(file, grid, choice[3] & 2 ? box : nullptr, kMaxMemory, &volume);
  require(succeeded(status) == (volume != nullptr));
  const std::unique_ptr<esvr_volume, void (*)(esvr_volume*)> owned(volume, esvr_free_volume);
  if (volume) readVolume(volume, description.nonfinite > 0, places);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < kChoiceBytes) return 0;
  const auto bytes =
      esvr::fuzz::repaired(std::as_bytes(std::span(data + kChoiceBytes, size - kChoiceBytes)));
  esvr_file* file = nullptr;
  const esvr_status status =
      esvr_open_memory(bytes.data(), bytes.size(), "fuzzed.esvr", kMaxMemory, &file);
  require(succeeded(status) == (file != nullptr));
  const std::unique_ptr<esvr_file, void (*)(esvr_file*)> owned(file, esvr_close);
  for (std::size_t g = 0; g < esvr_grid_count(file); ++g) readGrid(file, g, data);
  for (std::size_t c = 0; c <= esvr_carried_count(file); ++c)
    require(esvr_carried_name(file, c) != nullptr);
  return 0;
}
