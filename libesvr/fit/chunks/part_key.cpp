#include <xxhash.h>

#include <memory>
#include <optional>
#include <type_traits>

#include "fit/chunks/part.h"

namespace esvr {
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

void addOptions(Hash& hash, const FitOptions& options) {
  hash.add(options.seed);
  hash.add(options.device.kind);
  hash.add(options.narrowBand);
  hash.add(options.bothSigns);
}

void addKernel(Hash& hash, const Kernel& kernel) {
  hash.add(kernel.form);
  hash.add(kernel.kappa);
  hash.add(kernel.epsilon);
}

void addPlan(Hash& hash, const RunPlan& plan) {
  for (const std::uint64_t number : {std::uint64_t{plan.firstCount}, std::uint64_t{plan.count}})
    hash.add(number);
  hash.add(plan.iterations);
  hash.add(plan.psnr);
  hash.add(plan.seconds);
  hash.add(plan.learnKappa);
  hash.add(plan.from);
  hash.add(plan.to);
  hash.add(std::uint64_t{sizeof(AdamState)});  // stored parts of another version are of no use
  hash.addAll(plan.start.ellipsoids);
  hash.addAll(plan.start.adam);
}

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
  Hash hash;
  addOptions(hash, scene.options);
  hash.add(scene.box);
  hash.add(scene.halo);
  hash.add(std::uint64_t{start.chunk});
  hash.add(scene.chunks[start.chunk].box);
  addKernel(hash, start.kernel);
  addPlan(hash, start.plan);
  hash.addAll(start.ghosts);
  addVoxels(hash, scene, scene.chunks[start.chunk]);
  return hash.key();
}

}  // namespace esvr
