#include "esvr/esvr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "capi/objects.h"
#include "core/geometry.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/volume.h"
#include "field/voxel_rule.h"

// Failures become statuses and a text

namespace esvr::capi {
namespace {

/// The text of the last failure. It must be kept when there is no memory left, so that it is not
/// allocated; a text that is longer ends in "...". Texts have a path of at most 4,096 bytes in them.
thread_local std::array<char, 4608> lastText{};

esvr_status fail(esvr_status status, const char* text) noexcept {
  constexpr std::string_view kCut = "...";
  const std::size_t most = lastText.size() - 1, bytes = std::min(std::strlen(text), most);
  std::memmove(lastText.data(), text, bytes);
  lastText[bytes] = '\0';
  if (bytes == most) std::ranges::copy(kCut, lastText.begin() + std::ptrdiff_t(most - kCut.size()));
  return status;
}

esvr_status statusOf(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
      return ESVR_USAGE;
    case ErrorKind::kBadInput:
      return ESVR_BAD_INPUT;
    case ErrorKind::kDevice:
      return ESVR_MEMORY;
    default:
      return ESVR_FAILED;
  }
}

}  // namespace

esvr_status statusOfException() noexcept {
  try {
    throw;
  } catch (const Error& error) {
    return fail(statusOf(error.kind()), error.what());
  } catch (const std::bad_alloc&) {
    return fail(ESVR_MEMORY, "there is not enough memory");
  } catch (const std::length_error&) {
    return fail(ESVR_MEMORY, "an array would be larger than the address space");
  } catch (const std::exception& error) {
    return fail(ESVR_FAILED, error.what());
  } catch (...) {
    return fail(ESVR_FAILED, "an unknown failure");
  }
}

}  // namespace esvr::capi

const char* esvr_error(void) { return esvr::capi::lastText.data(); }

// What the functions do

namespace esvr {
namespace {

using capi::require;

static_assert(ESVR_BRICK_SIDE == kBrickSide && ESVR_BRICK_VOXELS == kBrickVoxels);

/// A limit of the caller, of which 0 stands for the usual one. Where addresses have 32 bits, sizes in
/// the code have, too, so that content stays below them.
std::uint64_t limitOf(std::uint64_t maxMemory) {
  constexpr std::uint64_t kMost = sizeof(std::size_t) < 8 ? std::uint64_t{1} << 31 : kNoMemoryLimit;
  return std::min(maxMemory == 0 ? usualMemoryLimit() : maxMemory, kMost);
}

/// Carried grids are checked, but nothing here can read their bytes.
ReadLimits limitsOf(std::uint64_t maxMemory) {
  return {.maxBytes = limitOf(maxMemory), .carriedBytes = false};
}

const StoredGrid& gridOf(const esvr_file* file, std::size_t grid) {
  require(file != nullptr, "there is no file");
  if (grid >= file->content.grids.size())
    throw UsageError(file->name + ": there is no grid " + std::to_string(grid) + "; there are " +
                     std::to_string(file->content.grids.size()));
  return file->content.grids[grid];
}

Box boxOf(const std::int32_t* box) { return {{box[0], box[1], box[2]}, {box[3], box[4], box[5]}}; }

void set(std::int32_t (&to)[6], const Box& box) {
  const std::int32_t numbers[] = {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z};
  std::copy(std::begin(numbers), std::end(numbers), to);
}

esvr_grid describe(const StoredGrid& grid) {
  esvr_grid d{};
  d.name = grid.descriptor.name.c_str();
  d.grid_class = std::int32_t(grid.descriptor.gridClass);
  if (const auto& affine = grid.descriptor.transform.affine) {
    d.has_transform = 1;
    std::copy(affine->begin(), affine->end(), d.transform);
  }
  d.background = float(grid.descriptor.background);
  d.low = grid.valueMin, d.high = grid.valueMax;
  set(d.box, grid.activeBox);
  d.active_voxels = grid.activeVoxels;
  d.ellipsoids = grid.field.ellipsoidCount();
  d.has_residual = grid.residual ? 1 : 0;
  d.tone = grid.tone.scale;
  d.nonfinite = grid.nonFinite.total();
  return d;
}

esvr_ellipsoid ellipsoidOf(const Field& field, const Chunk& chunk, std::size_t i) {
  const Ellipsoids& e = chunk.ellipsoids;
  const double origin[3] = {double(chunk.origin.x), double(chunk.origin.y), double(chunk.origin.z)};
  esvr_ellipsoid result{};
  for (std::size_t a = 0; a < 3; ++a) {
    result.center[a] = origin[a] + double(e.center[a][i]);
    result.scale[a] = std::exp(e.logScale[a][i]);
  }
  for (std::size_t a = 0; a < 4; ++a) result.rotation[a] = e.rotation[a][i];
  result.intensity = e.intensity[i];
  result.kappa = e.kappa.empty() ? field.kernel.kappa : e.kappa[i];
  return result;
}

/// Copies the ellipsoids `first` to `last` - 1, counted through all chunks.
void copyEllipsoids(const Field& field, std::uint64_t first, std::uint64_t last,
                    esvr_ellipsoid* to) {
  std::uint64_t begin = 0;
  for (const Chunk& chunk : field.chunks) {
    const std::uint64_t end = begin + chunk.ellipsoids.size();
    for (std::uint64_t n = std::max(first, begin); n < std::min(last, end); ++n)
      *to++ = ellipsoidOf(field, chunk, std::size_t(n - begin));
    begin = end;
  }
}

SparseVolume decoded(const StoredGrid& grid, const std::int32_t* box, std::uint64_t maxMemory) {
  DecodeOptions options;
  if (box != nullptr) options.box = boxOf(box);
  options.maxBytes = limitOf(maxMemory);
  return decodeGrid(grid, options);
}

/// An array of the caller that has a value for each voxel of a box.
template <class Value>
struct BoxArray {
  Box box;
  Value* values;

  [[nodiscard]] std::size_t count() const { return std::size_t(box.volume()); }
  [[nodiscard]] Value& operator[](Coord voxel) const {
    const std::size_t y = std::size_t(std::int64_t(box.max.y) - box.min.y + 1),
                      z = std::size_t(std::int64_t(box.max.z) - box.min.z + 1);
    const Coord at = voxel - box.min;
    return values[(std::size_t(at.x) * y + std::size_t(at.y)) * z + std::size_t(at.z)];
  }
};

void requireArray(const Box& box) {
  require(!box.empty(), "the box of voxels is empty");
  require(box.volume() * sizeof(float) <= double(std::numeric_limits<std::ptrdiff_t>::max()) &&
              double(box.max.x) - box.min.x <= Box::kMax &&
              double(box.max.y) - box.min.y <= Box::kMax &&
              double(box.max.z) - box.min.z <= Box::kMax,
          "the box of voxels is larger than an array can be");
}

void fill(const SparseVolume& volume, const BoxArray<float>& values,
          const BoxArray<std::uint8_t>& active) {
  std::fill_n(values.values, values.count(), volume.background);
  if (active.values != nullptr) std::fill_n(active.values, active.count(), std::uint8_t{0});
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord voxel = volume.brickCorner(b) + voxelLocal(v);
      if (!values.box.contains(voxel)) continue;
      values[voxel] = volume.brickValues(b)[std::size_t(v)];
      if (active.values != nullptr) active[voxel] = volume.active[b].test(v) ? 1 : 0;
    }
}

/// Interpolates trilinearly between the voxels of a volume.
class Sampler {
 public:
  explicit Sampler(const esvr_volume& volume) : volume_(volume) {}

  [[nodiscard]] float operator()(const double* place) const {
    const Coord origin = volume_.voxels.origin;
    const double at[3] = {place[0] - origin.x, place[1] - origin.y, place[2] - origin.z};
    for (const double a : at)
      if (!(a > -2.0 && a < double(Box::kMax))) return volume_.voxels.background;
    const Coord low{floorOf(at[0]), floorOf(at[1]), floorOf(at[2])};
    const float x = float(at[0] - low.x), y = float(at[1] - low.y), z = float(at[2] - low.z);
    float v[kCellCorners];
    for (int c = 0; c < kCellCorners; ++c) v[c] = valueAt(low + stepToCorner(c));
    const auto between = [](float a, float b, float s) { return a + s * (b - a); };
    return between(between(between(v[0], v[1], z), between(v[2], v[3], z), y),
                   between(between(v[4], v[5], z), between(v[6], v[7], z), y), x);
  }

 private:
  static std::int32_t floorOf(double a) { return std::int32_t(std::floor(a)); }

  /// \param voxel  relative to the volume's origin
  [[nodiscard]] float valueAt(Coord voxel) const {
    const std::uint32_t brick = volume_.index.find(brickOf(voxel));
    if (brick == BrickIndex::kNone) return volume_.voxels.background;
    return volume_.voxels.brickValues(brick)[std::size_t(voxelOffset(localOf(voxel)))];
  }

  const esvr_volume& volume_;
};

/// The places of a caller as the library takes them.
std::vector<Place> placesOf(const double* places, std::size_t count) {
  std::vector<Place> result(count);
  for (std::size_t p = 0; p < count; ++p)
    std::copy_n(places + 3 * p, result[p].size(), result[p].begin());
  return result;
}

void evaluate(const StoredGrid& grid, std::span<const Place> places, std::span<float> values) {
  if (!followsFromEllipsoids(grid))
    throw UsageError("grid '" + shownName(grid.descriptor.name) +
                     "' is not the sum of ellipsoids alone, and can only be decoded to voxels");
  evaluatePlaces(grid.field, places, values);
  const VoxelRule rule = makeVoxelRule(grid.field.background, voxelRule(grid));
  for (float& value : values) value = rule.settled(value);
}

}  // namespace
}  // namespace esvr

using namespace esvr;
using capi::guarded;

extern "C" {

const char* esvr_version(void) { return ESVR_VERSION; }

esvr_status esvr_open(const char* path, uint64_t max_memory, esvr_file** file) {
  return guarded([&] {
    require(path != nullptr && file != nullptr, "a path and a place for the file are needed");
    *file = nullptr;
    *file = new esvr_file{readEsvr(path, limitsOf(max_memory)), path};
  });
}

esvr_status esvr_open_memory(const void* bytes, size_t size, const char* name, uint64_t max_memory,
                             esvr_file** file) {
  return guarded([&] {
    require(bytes != nullptr && name != nullptr && file != nullptr,
            "bytes, a name and a place for the file are needed");
    *file = nullptr;
    *file = new esvr_file{
        decodeEsvr({static_cast<const std::byte*>(bytes), size}, name, limitsOf(max_memory)), name};
  });
}

void esvr_close(esvr_file* file) { delete file; }

size_t esvr_grid_count(const esvr_file* file) { return file ? file->content.grids.size() : 0; }

size_t esvr_carried_count(const esvr_file* file) { return file ? file->content.carried.size() : 0; }

const char* esvr_carried_name(const esvr_file* file, size_t carried) {
  return carried < esvr_carried_count(file) ? file->content.carried[carried].name.c_str() : "";
}

esvr_status esvr_get_grid(const esvr_file* file, size_t grid, esvr_grid* description) {
  return guarded([&] {
    require(description != nullptr && description->size >= sizeof description->size,
            "a description with its size is needed");
    const std::size_t size = std::min(description->size, sizeof *description);
    esvr_grid d = describe(gridOf(file, grid));
    d.size = size;
    std::memcpy(description, &d, size);
  });
}

esvr_status esvr_get_ellipsoids(const esvr_file* file, size_t grid, uint64_t first, uint64_t count,
                                esvr_ellipsoid* ellipsoids) {
  return guarded([&] {
    const Field& field = gridOf(file, grid).field;
    const std::uint64_t all = field.ellipsoidCount();
    require(ellipsoids != nullptr && first <= all && count <= all - first,
            "the grid does not have these ellipsoids");
    copyEllipsoids(field, first, first + count, ellipsoids);
  });
}

esvr_status esvr_evaluate(const esvr_file* file, size_t grid, size_t count, const double* places,
                          float* values) {
  return guarded([&] {
    const StoredGrid& stored = gridOf(file, grid);
    require(count == 0 || (places != nullptr && values != nullptr), "places and values are needed");
    evaluate(stored, placesOf(places, count), {values, count});
  });
}

esvr_status esvr_decode(const esvr_file* file, size_t grid, const int32_t* box, uint64_t max_memory,
                        esvr_volume** volume) {
  return guarded([&] {
    require(volume != nullptr, "a place for the volume is needed");
    *volume = nullptr;
    *volume = new esvr_volume(decoded(gridOf(file, grid), box, max_memory));
  });
}

void esvr_free_volume(esvr_volume* volume) { delete volume; }

esvr_status esvr_decode_box(const esvr_file* file, size_t grid, const int32_t* box,
                            uint64_t max_memory, float* values, uint8_t* active) {
  return guarded([&] {
    const StoredGrid& stored = gridOf(file, grid);
    require(box != nullptr && values != nullptr, "a box and an array of values are needed");
    requireArray(boxOf(box));
    fill(decoded(stored, box, max_memory), {boxOf(box), values}, {boxOf(box), active});
  });
}

size_t esvr_brick_count(const esvr_volume* volume) {
  return volume ? volume->voxels.brickCount() : 0;
}

esvr_status esvr_get_brick(const esvr_volume* volume, size_t brick, esvr_brick* description) {
  return guarded([&] {
    require(description != nullptr && brick < esvr_brick_count(volume),
            "the volume does not have this brick");
    const Coord corner = volume->voxels.brickCorner(brick);
    *description = {{corner.x, corner.y, corner.z},
                    volume->voxels.brickValues(brick).data(),
                    volume->voxels.active[brick].words.data()};
  });
}

esvr_status esvr_sample(const esvr_volume* volume, size_t count, const double* places,
                        float* values) {
  return guarded([&] {
    require(volume != nullptr, "there is no volume");
    require(count == 0 || (places != nullptr && values != nullptr), "places and values are needed");
    const Sampler valueAt(*volume);
    for (std::size_t p = 0; p < count; ++p) values[p] = valueAt(places + 3 * p);
  });
}

}  // extern "C"
