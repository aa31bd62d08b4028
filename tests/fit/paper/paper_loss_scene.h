#pragma once
/// Bricks with predictions and targets for the tests of the paper's loss, and the loss and gradient
/// by the textbook's formula.
/// The paper's loss by its definition, in float64 over every voxel of a box, with SSIM as in the
/// textbook. It shares neither the bricks nor the form of SSIM with the library.

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "esvr/volume.h"
#include "fit/volumes.h"

namespace esvr::test {

// ---- The loss over a dense array

/// The values of a box's voxels, which are zero outside.
class DenseValues {
 public:
  explicit DenseValues(const Box& box) : box_(box), values_(std::size_t(box.volume())) {}

  [[nodiscard]] const Box& box() const { return box_; }
  [[nodiscard]] double at(Coord v) const { return box_.contains(v) ? values_[offset(v)] : 0.0; }
  [[nodiscard]] double& operator[](Coord v) { return values_[offset(v)]; }

 private:
  [[nodiscard]] std::size_t offset(Coord v) const {
    const Coord side = box_.max - box_.min + Coord{1, 1, 1}, local = v - box_.min;
    return (std::size_t(local.x) * std::size_t(side.y) + std::size_t(local.y)) *
               std::size_t(side.z) +
           std::size_t(local.z);
  }
  Box box_;
  std::vector<double> values_;
};

struct DenseLossOptions {
  double voxels, beta, peak;
  std::optional<Box> windows{};  ///< voxels whose windows count; default: all

  [[nodiscard]] bool counts(Coord v) const { return !windows || windows->contains(v); }
};

/// Evaluates the loss. The box must extend at least 5 voxels, the radius of a window, beyond all
/// values that are not zero.
double densePaperLoss(const DenseValues& prediction, const DenseValues& target,
                      const DenseLossOptions& options);

/// Its derivative by the voxels of the prediction, by the chain rule through the moments m1 = w *
/// p, m2 = w * p^2 and m12 = w * (p t).
DenseValues densePaperLossGradient(const DenseValues& prediction, const DenseValues& target,
                                   const DenseLossOptions& options);

// ---- Scenes

inline constexpr int kMargin = 5;  // voxels beyond the bricks that windows overlap

struct Scene {
  std::vector<Coord> bricks;
  std::size_t targetBricks = 0;
  std::vector<float> prediction{}, target{};  // values of all bricks
  double voxels = 5000.0, beta = 0.2, peak = 1.0;
  std::optional<Box> within{};  // bricks whose voxels' windows count

  [[nodiscard]] DenseLossOptions denseOptions() const {
    DenseLossOptions options{voxels, beta, peak};
    if (within)
      options.windows = {within->min * kBrickSide,
                         (within->max + Coord{1, 1, 1}) * kBrickSide - Coord{1, 1, 1}};
    return options;
  }
};

/// Bricks that touch by face, edge and corner, or have one brick between them, on both sides of
/// zero. The last three have a prediction only.
inline std::vector<Coord> mixedBricks() {
  return {{-2, -1, 0}, {-1, -1, 0}, {-1, 0, 1}, {0, 1, 0}, {0, -1, -1}, {-1, -1, 1}, {1, 1, 1}};
}

using ValueAt = std::function<float(Coord)>;

inline Scene makeScene(const std::vector<Coord>& bricks, std::size_t targetBricks,
                       const ValueAt& target, const ValueAt& prediction) {
  Scene scene{.bricks = bricks, .targetBricks = targetBricks};
  for (std::size_t b = 0; b < bricks.size(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = bricks[b] * kBrickSide + voxelLocal(v);
      scene.target.push_back(b < targetBricks ? target(at) : 0.0f);
      scene.prediction.push_back(prediction(at));
    }
  return scene;
}

inline Scene randomScene(std::uint64_t seed, const std::vector<Coord>& bricks = mixedBricks()) {
  Random random(seed);
  const auto value = [&](Coord) { return float(random(0.0, 1.0)); };
  return makeScene(bricks, (bricks.size() + 1) / 2, value, value);
}

/// The scene with bricks of zeros around its own and between them. The zeros are of both signs, as
/// a residual 0 - t has the sign of -0.
inline Scene withBricksOfZeros(const Scene& scene) {
  Scene padded = scene;
  for (int i = 0; i < 125; ++i) {
    const Coord brick{i / 25 - 3, i / 5 % 5 - 2, i % 5 - 2};
    if (std::find(scene.bricks.begin(), scene.bricks.end(), brick) == scene.bricks.end())
      padded.bricks.push_back(brick);
  }
  padded.target.resize(padded.bricks.size() * kBrickVoxels);
  padded.prediction.resize(padded.target.size(), -0.0f);
  return padded;
}

/// Prediction less target. Exact for values of one exponent or multiples of one step, which these
/// tests use where they compare bits.
inline std::vector<float> residualOf(const Scene& scene) {
  std::vector<float> residual(scene.target.size());
  for (std::size_t v = 0; v < residual.size(); ++v)
    residual[v] = scene.prediction[v] - scene.target[v];
  return residual;
}

struct LossAndGradient {
  double loss = 0.0;
  std::vector<float> gradient;
};

inline Box boxAround(const std::vector<Coord>& bricks, int margin) {
  Box box;
  for (const Coord b : bricks) {
    box.expand(b * kBrickSide - Coord{margin, margin, margin});
    box.expand((b + Coord{1, 1, 1}) * kBrickSide + Coord{margin - 1, margin - 1, margin - 1});
  }
  return box;
}

inline DenseValues denseOf(const Scene& scene, const std::vector<float>& values) {
  DenseValues dense(boxAround(scene.bricks, kMargin));
  for (std::size_t v = 0; v < values.size(); ++v)
    dense[scene.bricks[v / kBrickVoxels] * kBrickSide + voxelLocal(int(v % kBrickVoxels))] =
        values[v];
  return dense;
}

/// The prediction as the library gets it: target + residual, with the residual in float32.
inline DenseValues densePrediction(const Scene& scene) {
  const auto residual = residualOf(scene);
  DenseValues dense = denseOf(scene, scene.target);
  const DenseValues difference = denseOf(scene, residual);
  for (std::size_t v = 0; v < residual.size(); ++v) {
    const Coord at =
        scene.bricks[v / kBrickVoxels] * kBrickSide + voxelLocal(int(v % kBrickVoxels));
    dense[at] += difference.at(at);
  }
  return dense;
}

inline double denseLoss(const Scene& scene) {
  return densePaperLoss(densePrediction(scene), denseOf(scene, scene.target), scene.denseOptions());
}

inline std::vector<double> denseGradient(const Scene& scene) {
  const DenseValues dense = densePaperLossGradient(
      densePrediction(scene), denseOf(scene, scene.target), scene.denseOptions());
  std::vector<double> gradient(scene.target.size());
  for (std::size_t v = 0; v < gradient.size(); ++v)
    gradient[v] =
        dense.at(scene.bricks[v / kBrickVoxels] * kBrickSide + voxelLocal(int(v % kBrickVoxels)));
  return gradient;
}

template <class A, class B>
double relativeDifference(const std::vector<A>& values, const std::vector<B>& reference) {
  double difference = 0.0, norm = 0.0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    difference += std::pow(double(values[i]) - double(reference[i]), 2);
    norm += std::pow(double(reference[i]), 2);
  }
  return std::sqrt(difference / norm);
}

}  // namespace esvr::test
