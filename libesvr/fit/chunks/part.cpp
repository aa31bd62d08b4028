#include "fit/chunks/chunks.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <type_traits>

#include "core/brick_index.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "field/support.h"
#include "fit/cuda/make_cuda.h"

namespace esvr {

Coord brickWith(const Ellipsoid& p) {
  const auto brick = [](double v) { return std::int32_t(std::floor(v / kBrickSide)); };
  return {brick(p.center[0]), brick(p.center[1]), brick(p.center[2])};
}

// --- The target.

namespace {

/// The voxels of a box of bricks, as far as coordinates reach.
Box voxelsOf(const Box& bricks) {
  const auto bounded = [](std::int64_t coordinate) {
    return std::int32_t(std::clamp<std::int64_t>(coordinate, Box::kMin, Box::kMax));
  };
  Box box;
  for (const auto axis : kAxes) {
    box.min.*axis = bounded(std::int64_t{bricks.min.*axis} * kBrickSide);
    box.max.*axis = bounded((std::int64_t{bricks.max.*axis} + 1) * kBrickSide - 1);
  }
  return box;
}

/// The sums of ellipsoids in the bricks of a target; empty if they reach none.
std::vector<float> sumsIn(const FitTarget& target, const Ghosts& ghosts) {
  const Field field = exportField(ghosts.ellipsoids, {{}, 1.0, 0.0f, ghosts.kernel});
  const BrickIndex index(target.bricks);
  std::vector<Coord> corners;
  for (const Coord corner : reachedBricks(field, voxelsOf(index.bounds())))
    if (index.find(brickOf(corner)) != BrickIndex::kNone) corners.push_back(corner);
  if (corners.empty()) return {};
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricks(field, corners, values);
  std::vector<float> sums(target.values.size());
  parallelFor(std::size_t{0}, corners.size(), [&](std::size_t n) {
    const auto from = values.begin() + std::ptrdiff_t(n * kBrickVoxels);
    const std::size_t b = index.find(brickOf(corners[n]));
    std::copy_n(from, kBrickVoxels, sums.begin() + std::ptrdiff_t(b * kBrickVoxels));
  });
  return sums;
}

}  // namespace

Box boxOf(const FitScene& scene, const BrickChunk& chunk) {
  return common(scene.box, voxelsOf(chunk.box));
}

ChunkTarget::ChunkTarget(const FitScene& scene, const BrickChunk& chunk, const Ghosts& ghosts) {
  const SparseVolume& volume = scene.volume;
  const auto bricks = bricksAround(volume, scene.chunks, chunk, scene.halo);
  target = makeTarget({volume, bricks}, boxOf(scene, chunk), scene.scale);
  for (const std::uint32_t b : bricks)
    counted.push_back(chunk.box.contains(volume.bricks[b]) ? volume.active[b] : BrickMask{});
  target.active = &counted;
  target.largestScale =
      scene.halo * kBrickSide / supportRadius(kernelConstants<double>(ghosts.kernel));
  target.within = dilated(chunk.bounds, scene.halo);
  target.constants = sumsIn(target, ghosts);
}

// --- The fit.

DeviceTurns::Turn DeviceTurns::take(const Device& device) {
  if (device.kind == DeviceKind::kCpu) return {};
  Gpu* used = nullptr;
  {
    const std::lock_guard lock(mutex_);
    used = &gpus_[device.index];
  }
  Turn turn(used->inUse);
  if (!used->keptMemory) used->keptMemory = keepFreedMemory(device);
  return turn;
}

namespace {

/// The ellipsoids in a chunk's box.
FitState within(const Box& box, const FitState& all) {
  FitState kept;
  for (std::size_t i = 0; i < all.ellipsoids.size(); ++i) {
    if (!box.contains(brickWith(all.ellipsoids[i]))) continue;
    kept.ellipsoids.push_back(all.ellipsoids[i]);
    kept.adam.push_back(all.adam[i]);
  }
  return kept;
}

OptimiserOptions optimiserOptions(const FitOptions& options, const PartStart& start,
                                  const Device& device) {
  constexpr int kChunkBits = 40;  // above those by which an optimiser varies its seed
  const std::uint64_t seed = options.seed ^ (std::uint64_t(start.chunk + 1) << kChunkBits);
  return {start.kernel, seed, device, options.maxDeviceBytes};
}

PartEnd endOf(Optimiser& optimiser, const RunEnd& run, const PartStart& start, const Box& box) {
  const BestSoFar completion;
  PartEnd end;
  if (start.plan.to == 1.0 && run.end != FitEnd::kCancelled) optimiser.dropUnseen();
  end.errors = optimiser.measure();
  end.fit = within(box, optimiser.state());
  end.kernel = optimiser.kernel();
  end.pairs = optimiser.pairCount();
  end.end = run.end;
  end.iterations = run.iterations;
  end.deviceBytes = optimiser.deviceBytes();
  end.deviceFull = optimiser.deviceFull();
  end.secondsSeed = optimiser.secondsSeeding();
  return end;
}

}  // namespace

PartEnd fitPart(const FitScene& scene, const PartStart& start, const PartPlace& place) {
  const BrickChunk& chunk = scene.chunks[start.chunk];
  ChunkTarget part(scene, chunk, {start.ghosts, start.kernel});
  const bool isZero = std::ranges::all_of(part.target.values, [](float v) { return v == 0.0f; });
  if (isZero || start.plan.count == 0) return unchanged(scene, start);
  applyOptions(scene.options, part.target);
  CommonFitOptions options = scene.options;
  options.progress = place.progress;
  const Tuning tuning = Tuning::forRun(plannedIterations(scene.options));
  const auto turn = place.turns.take(place.device);
  Recorder recorder(part.target, options);
  const auto optimiser =
      makeOptimiser(part.target, optimiserOptions(scene.options, start, place.device), tuning);
  const RunEnd end = run(*optimiser, part.target, recorder, start.plan, tuning);
  return endOf(*optimiser, end, start, chunk.box);
}

PartEnd unchanged(const FitScene& scene, const PartStart& start) {
  PartEnd end;
  end.fit = within(scene.chunks[start.chunk].box, start.plan.start);
  end.kernel = start.kernel;
  end.errors = start.errors;
  end.pairs = start.pairs;
  return end;
}

// --- The key.

namespace {

class Hash {
 public:
  Hash() : state_(XXH3_createState(), XXH3_freeState) { XXH3_128bits_reset(state_.get()); }

  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void add(T value) { addAll(std::span<const T>(&value, 1)); }
  template <class T>
  void add(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  void add(const Coord& c) {
    for (const std::int32_t coordinate : {c.x, c.y, c.z}) add(coordinate);
  }
  void add(const Box& box) {
    add(box.min);
    add(box.max);
  }
  /// \param values  numbers or structs without padding
  template <class T, std::size_t N>
  void addAll(std::span<const T, N> values) {
    XXH3_128bits_update(state_.get(), values.data(), values.size_bytes());
  }
  template <class T>
  void addAll(const std::vector<T>& values) {
    add(std::uint64_t{values.size()});
    addAll(std::span<const T>(values));
  }
  [[nodiscard]] PartKey key() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
    return {hash.low64, hash.high64};
  }

 private:
  std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state_;
};

static_assert(sizeof(Ellipsoid) == 13 * sizeof(double));
static_assert(sizeof(AdamState) == (2 * kParameters + 1) * sizeof(float));

/// The voxels of the chunk and of its halo.
void addVoxels(Hash& hash, const FitScene& scene, const BrickChunk& chunk) {
  const SparseVolume& volume = scene.volume;
  hash.add(volume.origin);
  hash.add(volume.background);
  for (const double number :
       {scene.scale.scale, scene.scale.peak, scene.scale.lowest, scene.scale.highest})
    hash.add(number);
  for (const std::uint32_t b : bricksAround(volume, scene.chunks, chunk, scene.halo)) {
    hash.add(volume.bricks[b]);
    hash.addAll(volume.brickValues(b));
    hash.addAll(std::span(&volume.active[b], 1));
  }
}

}  // namespace

PartKey keyOf(const FitScene& scene, const PartStart& start) {
  const FitOptions& options = scene.options;
  const RunPlan& plan = start.plan;
  Hash hash;
  hash.add(options.seed);
  hash.add(options.device.kind);
  hash.add(options.narrowBand);
  hash.add(options.bothSigns);
  hash.add(scene.box);
  hash.add(scene.halo);
  hash.add(std::uint64_t{start.chunk});
  hash.add(scene.chunks[start.chunk].box);
  hash.add(start.kernel.form);
  hash.add(start.kernel.kappa);
  hash.add(start.kernel.epsilon);
  hash.add(std::uint64_t{plan.firstCount});
  hash.add(std::uint64_t{plan.count});
  hash.add(plan.iterations);
  hash.add(plan.psnr);
  hash.add(plan.seconds);
  hash.add(plan.learnKappa);
  hash.add(plan.from);
  hash.add(plan.to);
  hash.add(std::uint64_t{sizeof(AdamState)});  // stored parts of another version are of no use
  hash.addAll(plan.start.ellipsoids);
  hash.addAll(plan.start.adam);
  hash.addAll(start.ghosts);
  addVoxels(hash, scene, scene.chunks[start.chunk]);
  return hash.key();
}

// --- The end as bytes.

namespace {

template <class T>
concept Plain = std::is_trivially_copyable_v<T>;

class BytesOut {
 public:
  template <Plain T>
  void operator()(const T& value) {
    append(std::as_bytes(std::span(&value, 1)));
  }
  template <Plain T>
  void operator()(const std::vector<T>& values) {
    (*this)(std::uint64_t{values.size()});
    append(std::as_bytes(std::span(values)));
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void append(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte> bytes_;
};

class BytesIn {
 public:
  explicit BytesIn(std::span<const std::byte> bytes) : left_(bytes) {}

  template <Plain T>
  void operator()(T& value) {
    std::memcpy(&value, next(sizeof value).data(), sizeof value);
  }
  template <Plain T>
  void operator()(std::vector<T>& values) {
    std::uint64_t count = 0;
    (*this)(count);
    if (count > left_.size() / sizeof(T)) fail();
    values.resize(count);
    const auto bytes = next(count * sizeof(T));
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  }
  void finish() const {
    if (!left_.empty()) fail();
  }

 private:
  [[noreturn]] static void fail() { throw BadInput("the result of a part is damaged"); }
  std::span<const std::byte> next(std::size_t count) {
    if (count > left_.size()) fail();
    const auto bytes = left_.first(count);
    left_ = left_.subspan(count);
    return bytes;
  }
  std::span<const std::byte> left_;
};

/// Passes all members to a writer or a reader, in the same order.
void passAll(auto& bytes, auto& part) {
  bytes(part.fit.ellipsoids);
  bytes(part.fit.adam);
  bytes(part.kernel.form);
  bytes(part.kernel.kappa);
  bytes(part.kernel.epsilon);
  bytes(part.errors.squaredSum);
  bytes(part.errors.squaredSumBox);
  bytes(part.errors.squaredSumActive);
  bytes(part.errors.largest);
  bytes(part.pairs);
  bytes(part.end);
  bytes(part.iterations);
  bytes(part.deviceBytes);
  bytes(part.deviceFull);
  bytes(part.secondsSeed);
}

}  // namespace

std::vector<std::byte> bytesOf(const PartEnd& end) {
  BytesOut out;
  passAll(out, end);
  return out.take();
}

PartEnd partOf(std::span<const std::byte> bytes) {
  PartEnd end;
  BytesIn in(bytes);
  passAll(in, end);
  in.finish();
  if (end.fit.ellipsoids.size() != end.fit.adam.size() || end.end > FitEnd::kPsnrMissed)
    throw BadInput("the result of a part is damaged");
  return end;
}

}  // namespace esvr
