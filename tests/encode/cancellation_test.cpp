// Plan: a conversion that is cancelled at any look at its token ends with a grid that keeps its promises,
// or with Cancelled. On a volume of 5 million voxels, every phase of a conversion looks at the token so
// often that it ends within two seconds, and so does a whole conversion.

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <string>

#include "encode/rate_control.h"
#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"
#include "support/files.h"

namespace esvr {
namespace {

/// Two seconds are promised to a user; the machine of a test may have three times as much to do.
constexpr double kMostSeconds = 6.0;

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A token that counts how often it is looked at, and may be set at one of these looks. It knows the
/// longest time for which no thread has looked.
class CountingToken : public CancelToken {
 public:
  explicit CountingToken(std::uint64_t last = ~std::uint64_t{0}) : last_(last) {}

  [[nodiscard]] bool cancelled() const noexcept override {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    longestGap_ = std::max(longestGap_, std::chrono::duration<double>(now - latest_).count());
    latest_ = now;
    return ++looks_ >= last_ || CancelToken::cancelled();
  }
  [[nodiscard]] std::uint64_t looks() const { return looks_; }
  [[nodiscard]] double longestGap() const { return longestGap_; }

 private:
  std::uint64_t last_;
  mutable std::mutex mutex_;
  mutable std::uint64_t looks_ = 0;
  mutable Clock::time_point latest_ = Clock::now();
  mutable double longestGap_ = 0.0;
};

struct Wanted {
  std::string name;
  Goal goal;
  Representation representation = Representation::kAuto;
  bool band = false;
  std::optional<ToneCurve> tone{};
};

std::vector<Wanted> goals() {
  return {{"preset", PresetGoal{}},
          {"size", SizeGoal{1500}},
          {"size of voxels", SizeGoal{9000}, Representation::kVoxels},
          {"psnr", PsnrGoal{32.0}},
          {"psnr of ellipsoids", PsnrGoal{30.0}, Representation::kEllipsoids},
          {"bound", BoundGoal{.bound = 0.02}},
          {"lossless", LosslessGoal{}},
          {"fit", FitGoal{}},
          {"tone", PresetGoal{}, Representation::kEllipsoids, false, ToneCurve{0.1f}},
          {"band", PresetGoal{}, Representation::kAuto, true}};
}

/// \return nothing if the conversion had no result when it was cancelled
std::optional<Conversion> converted(const Wanted& wanted, const SparseVolume& volume,
                                    const CancelToken& token) try {
  GridDescriptor descriptor;
  descriptor.gridClass = wanted.band ? GridClass::kLevelSet : GridClass::kFogVolume;
  ConvertOptions options;
  options.goal = wanted.goal;
  options.representation = wanted.representation;
  options.tone = wanted.tone;
  options.fit.cancel = &token;
  options.fit.iterations = 20;
  options.fit.count = 80;
  return convertVolume({descriptor, volume}, options);
} catch (const Cancelled&) {
  return std::nullopt;
}

void expectPromises(const Wanted& wanted, const SparseVolume& volume, const StoredGrid& grid) {
  EsvrFile file;
  file.grids.push_back(grid);
  EXPECT_EQ(decodeEsvr(encodeEsvr(file), "file").grids.size(), 1u);
  const SparseVolume decoded = decodeGrid(grid);
  EXPECT_GT(activeVoxelCount(decoded), 0u);
  if (const auto* size = std::get_if<SizeGoal>(&wanted.goal)) {
    EXPECT_LE(bytesAdded(grid), size->bytes);
  }
  if (const auto* bound = std::get_if<BoundGoal>(&wanted.goal)) {
    EXPECT_LE(largestDifference(volume, decoded), bound->bound);
  }
  if (std::holds_alternative<LosslessGoal>(wanted.goal)) {
    EXPECT_EQ(largestDifference(volume, decoded), 0.0);
  }
}

TEST(Cancellation, SlowAtAnyLookLeavesAGridThatKeepsItsPromisesOrNone) {
  const SparseVolume fog = test::smoothVolume(), band = test::levelSetVolume();
  std::size_t results = 0;
  for (const Wanted& wanted : goals()) {
    const SparseVolume& volume = wanted.band ? band : fog;
    const CountingToken counting;
    ASSERT_TRUE(converted(wanted, volume, counting)) << wanted.name;
    constexpr int kTrials = 8;
    for (int n = 0; n <= kTrials; ++n) {
      const CountingToken token(1 + counting.looks() * std::uint64_t(n) / kTrials);
      SCOPED_TRACE(wanted.name + ", look " + std::to_string(n) + " of " + std::to_string(kTrials));
      const auto conversion = converted(wanted, volume, token);
      if (n == 0) {
        EXPECT_FALSE(conversion);
      }
      // Fits have a result from their first iteration on, which only has to be completed.
      if (wanted.representation == Representation::kEllipsoids && n > 1) {
        EXPECT_TRUE(conversion);
      }
      if (!conversion) continue;
      ++results;
      expectPromises(wanted, volume, conversion->grid);
    }
  }
  EXPECT_GT(results, 20u);  // most of what is cancelled late has a result
}

/// A whole fit that has just begun is worse than the short one before it, which is then the result.
TEST(Cancellation, LaterLeavesNoMuchWorseGrid) {
  const SparseVolume volume = test::smoothVolume();
  for (const Goal& goal : {Goal{SizeGoal{1500}}, Goal{PsnrGoal{45.0}}}) {
    ConvertOptions options;
    options.goal = goal;
    options.representation = Representation::kEllipsoids;
    const auto cancelledBy = [&](const CancelToken& token) -> std::optional<double> {
      options.fit.cancel = &token;
      try {
        const Conversion made = convertVolume({{}, volume}, options);
        return compareVolumes(volume, decodeGrid(made.grid)).psnrBox;
      } catch (const Cancelled&) {
        return std::nullopt;
      }
    };
    const CountingToken counting;
    ASSERT_TRUE(cancelledBy(counting));
    constexpr int kTrials = 12;
    constexpr double kByRounding = 6.0;  // dB that are lost where the rounding is cancelled
    double best = 0.0;
    for (int n = 1; n <= kTrials; ++n) {
      const CountingToken token(counting.looks() * std::uint64_t(n) / kTrials);
      const auto psnr = cancelledBy(token);
      if (!psnr) continue;
      EXPECT_GT(*psnr, best - kByRounding) << n << " of " << kTrials;
      best = std::max(best, *psnr);
    }
    EXPECT_GT(best, 30.0);
  }
}

/// 5.5 million active voxels with waves of several lengths and some noise.
SparseVolume largeVolume() {
  return test::volumeOf({}, 22, 0.0f, [](Coord v) {
    const double waves =
        std::sin(v.x * 0.11) * std::cos(v.y * 0.07) + std::sin(v.z * 0.19 + v.x * 0.05);
    const auto noise = double((std::uint32_t(v.x) * 73856093u ^ std::uint32_t(v.y) * 19349663u ^
                               std::uint32_t(v.z) * 83492791u) %
                              1000u);
    return float(2.5 + waves + 1e-4 * noise);
  });
}

/// What a call does after its token is set while it runs.
struct Interruption {
  bool wasRunning = false;
  double secondsToEnd = 0.0, longestGap = 0.0;
};

/// Runs a call on another thread, sets its token after a time, and waits for its end.
Interruption interrupted(double after, const std::function<void(const CancelToken&)>& call) {
  CountingToken token;
  auto running = std::async(std::launch::async, [&] {
    const CancelScope scope(&token);
    try {
      call(token);
    } catch (const Cancelled&) {
    }
  });
  Interruption result;
  result.wasRunning =
      running.wait_for(std::chrono::duration<double>(after)) == std::future_status::timeout;
  result.longestGap = token.longestGap();
  token.cancel();
  const auto start = Clock::now();
  running.get();
  result.secondsToEnd = secondsSince(start);
  return result;
}

TEST(Cancellation, SlowEndsEveryPhaseOfALargeConversionWithinTwoSeconds) {
  const SparseVolume volume = largeVolume();
  ASSERT_GT(activeVoxelCount(volume), 5'000'000u);
  const GridDescriptor descriptor;
  const test::TemporaryFolder folder;
  FitOptions short_;
  short_.count = 4000, short_.iterations = 3;
  const FitResult fitted = fit(volume, short_);
  const StoredGrid grid = makeStoredGrid(descriptor, volume, fitted.field);
  const VoxelLayer layer = boundedLayer(volume, 0.01, Activity::kByValue);
  const StoredGrid voxels = makeStoredVoxels(descriptor, volume, layer);
  const SparseVolume decoded = decodeGrid(grid);
  VolumeGrid source{descriptor, volume};
  source.descriptor.name = "density";
  source.descriptor.transform = uniformTransform(1.0);
  const std::span<const VolumeGrid> sources(&source, 1);
  writeGrids(folder / "in.vdb", {}, sources);
  const auto encoded = encodeEsvr({{}, {voxels}});

  const std::vector<std::pair<std::string, std::function<void(const CancelToken&)>>> phases{
      {"reading", [&](auto&) { (void)readGrid(folder / "in.vdb", "density"); }},
      {"hashing",
       [&](auto&) {
         (void)keyOf({descriptor, volume});
       }},
      {"exact voxels",
       [&](auto&) { (void)bytesAdded(makeStoredVoxels(descriptor, volume, exactLayer(volume))); }},
      {"rounding voxels", [&](auto&) { (void)boundedLayer(volume, 0.01, Activity::kByValue); }},
      {"choosing codes", [&](auto&) { (void)thriftyLayer(volume, layer, {.bitPrice = 0.1}); }},
      {"coding voxels",
       [&](auto&) {
         (void)encodeEsvr({{}, {voxels}});
       }},
      {"decoding voxels", [&](auto&) { (void)decodeEsvr(encoded, "voxels"); }},
      {"fitting",
       [&](auto& token) {
         FitOptions options;
         options.count = 4000;
         options.cancel = &token;
         (void)fit(volume, options);
       }},
      {"choosing active voxels",
       [&](auto&) { (void)makeStoredGrid(descriptor, volume, fitted.field); }},
      {"rate control", [&](auto&) { (void)encode::compactGrid(grid, volume); }},
      {"rate control for a size",
       [&](auto&) { (void)encode::compactGrid(grid, volume, {.bytes = 20'000}); }},
      {"evaluating", [&](auto&) { (void)decodeGrid(grid); }},
      {"measuring", [&](auto&) { (void)compareVolumes(volume, decoded, {.ssim = true}); }},
      {"writing",
       [&](auto&) {
         writeEsvr(folder / "out.esvr", {{}, {voxels}}, {.overwrite = true});
       }},
      {"writing OpenVDB",
       [&](auto&) { writeGrids(folder / "out.vdb", {}, sources, {.overwrite = true}); }}};
  for (const auto& [name, phase] : phases) {
    for (const double after : {0.05, 0.4}) {
      const Interruption found = interrupted(after, phase);
      EXPECT_LT(found.secondsToEnd, kMostSeconds) << name;
      EXPECT_LT(found.longestGap, kMostSeconds) << name;
      std::cout << name << ": " << (found.wasRunning ? "" : "had ended, ") << found.secondsToEnd
                << " s\n";
      if (!found.wasRunning) break;
    }
  }
}

TEST(Cancellation, SlowEndsALargeConversionWithinTwoSeconds) {
  const SparseVolume volume = largeVolume();
  const GridDescriptor descriptor;
  double after = 0.0;
  for (const Wanted& wanted : goals()) {
    if (wanted.band) continue;
    after =
        std::fmod(after + 0.7, 4.0);  // the goals are in different phases when they are cancelled
    std::optional<Conversion> conversion;
    const Interruption found = interrupted(after, [&](const CancelToken& token) {
      ConvertOptions options;
      options.goal = wanted.goal;
      if (std::holds_alternative<SizeGoal>(wanted.goal)) options.goal = SizeGoal{200'000};
      options.representation = wanted.representation;
      options.fit.cancel = &token;
      conversion = convertVolume({descriptor, volume}, options);
    });
    EXPECT_LT(found.secondsToEnd, kMostSeconds) << wanted.name << " after " << after << " s";
    std::cout << wanted.name << " after " << after
              << " s: " << (found.wasRunning ? "" : "had ended, ") << found.secondsToEnd << " s, "
              << (conversion ? "a grid" : "nothing") << '\n';
  }
}

}  // namespace
}  // namespace esvr
