#include <tiny-cuda-nn/config.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>

#include "model.h"

namespace ngp {
namespace {

using tcnn::GPUMatrix;
using tcnn::GPUMemory;
using Half = tcnn::network_precision_t;
using Model = tcnn::TrainableModel;

static_assert(sizeof(Half) == sizeof(std::uint16_t), "parameters are stored as float16");

constexpr std::uint32_t kBatch = 1u << 18;  // voxels of a step and of an evaluation
constexpr std::uint32_t kBaseResolution = 16;
constexpr std::uint32_t kDecays = 10;   // of the learning rate, in the last third of the steps
constexpr double kNetworkShare = 0.25;  // of the parameters, unless the network is the smallest
constexpr std::uint32_t kSmallestNeurons = 16;
constexpr std::uint32_t kFewestLevels = 4, kFewestTableBits = 6;

std::uint32_t longest(const Sides& sides) { return *std::max_element(sides.begin(), sides.end()); }

/// The growth of the resolution from level to level, so that the last one has that of the volume.
double levelScale(const Sides& sides, std::uint32_t levels) {
  const double growth = std::max(1.0, double(longest(sides)) / kBaseResolution);
  return levels > 1 ? std::pow(growth, 1.0 / (levels - 1)) : 1.0;
}

tcnn::json encodingOf(const Sides& sides, const Shape& shape) {
  return {{"otype", "HashGrid"},
          {"n_levels", shape.levels},
          {"n_features_per_level", 2},
          {"log2_hashmap_size", shape.tableBits},
          {"base_resolution", std::min(kBaseResolution, longest(sides))},
          {"per_level_scale", levelScale(sides, shape.levels)}};
}

tcnn::json networkOf(const Shape& shape) {
  return {{"otype", "FullyFusedMLP"},
          {"activation", "ReLU"},
          {"output_activation", "None"},
          {"n_neurons", shape.neurons},
          {"n_hidden_layers", 2}};
}

tcnn::json optimiserOf(std::uint32_t steps) {
  const tcnn::json adam = {{"otype", "Adam"},
                           {"learning_rate", 1e-2},
                           {"beta1", 0.9},
                           {"beta2", 0.99},
                           {"epsilon", 1e-15}};
  return {{"otype", "ExponentialDecay"},
          {"decay_start", 2 * steps / 3},
          {"decay_interval", std::max(1u, steps / (3 * kDecays))},
          {"decay_base", 0.5},
          {"nested", adam}};
}

Model makeModel(const Sides& sides, const Shape& shape, std::uint32_t steps) {
  return tcnn::create_from_config(3, 1,
                                  {{"loss", {{"otype", "L2"}}},
                                   {"optimizer", optimiserOf(steps)},
                                   {"encoding", encodingOf(sides, shape)},
                                   {"network", networkOf(shape)}});
}

/// The parameters of a model and of its network alone.
struct Counts {
  std::size_t all = 0, network = 0;
};

Counts countsOf(const Sides& sides, const Shape& shape) {
  const tcnn::NetworkWithInputEncoding<Half> model(3, 1, encodingOf(sides, shape),
                                                   networkOf(shape));
  return {model.n_params(), model.n_params() - model.encoding()->n_params()};
}

bool isBalanced(const Shape& shape, const Counts& counts) {
  return shape.neurons == kSmallestNeurons ||
         double(counts.network) <= kNetworkShare * double(counts.all);
}

/// The shape with the most parameters in these bytes.
Shape shapeFor(const Sides& sides, std::uint64_t bytes) {
  std::optional<Shape> best;
  std::size_t most = 0;
  for (const std::uint32_t neurons : {64u, 32u, kSmallestNeurons})
    for (std::uint32_t levels = kMostLevels; levels >= kFewestLevels; --levels)
      for (std::uint32_t bits = kFewestTableBits; bits <= kMostTableBits; ++bits) {
        const Shape shape{levels, bits, neurons};
        const Counts counts = countsOf(sides, shape);
        const bool fits = kHeaderBytes + counts.all * sizeof(Half) <= bytes;
        if (!fits || counts.all <= most || !isBalanced(shape, counts)) continue;
        best = shape, most = counts.all;
      }
  if (!best) throw std::runtime_error("no model takes at most " + std::to_string(bytes) + " bytes");
  return *best;
}

struct Grid {
  std::uint32_t nx, ny, nz;
  float scale;  ///< of coordinates to the unit cube
};

Grid gridOf(const Sides& sides) {
  return {sides[0], sides[1], sides[2], 1.0f / float(longest(sides))};
}

__device__ void putPosition(const Grid& grid, std::uint64_t voxel, float* position) {
  position[0] = (float(voxel % grid.nx) + 0.5f) * grid.scale;
  position[1] = (float(voxel / grid.nx % grid.ny) + 0.5f) * grid.scale;
  position[2] = (float(voxel / grid.nx / grid.ny) + 0.5f) * grid.scale;
}

/// The 64 random bits of a counter (the mixer of SplitMix64).
__device__ std::uint64_t randomBits(std::uint64_t counter) {
  std::uint64_t z = (counter + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/// Fills a batch with voxels that are drawn uniformly.
__global__ void sample(Grid grid, const float* voxels, float factor, std::uint64_t first,
                       float* positions, float* values) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= kBatch) return;
  const std::uint64_t count = std::uint64_t(grid.nx) * grid.ny * grid.nz;
  const std::uint64_t voxel = __umul64hi(randomBits(first + i), count);
  putPosition(grid, voxel, positions + 3 * std::size_t(i));
  values[i] = voxels[voxel] * factor;
}

/// Fills a batch with the voxels from `first` on; the last one is repeated.
__global__ void enumerate(Grid grid, std::uint64_t first, float* positions) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= kBatch) return;
  const std::uint64_t last = std::uint64_t(grid.nx) * grid.ny * grid.nz - 1;
  putPosition(grid, min(first + i, last), positions + 3 * std::size_t(i));
}

constexpr unsigned kThreads = 256, kBlocks = kBatch / kThreads;

float largestMagnitude(const std::vector<float>& voxels) {
  float most = 0.0f;
  for (const float v : voxels) most = std::max(most, std::abs(v));
  return most;
}

std::vector<std::uint16_t> download(const Half* parameters, std::size_t count) {
  std::vector<std::uint16_t> bits(count);
  CUDA_CHECK_THROW(
      cudaMemcpy(bits.data(), parameters, count * sizeof(Half), cudaMemcpyDeviceToHost));
  return bits;
}

}  // namespace

Stored train(const std::vector<float>& voxels, const Sides& sides, const TrainOptions& options) {
  Stored stored{sides, shapeFor(sides, options.bytes), largestMagnitude(voxels), {}};
  Model model = makeModel(sides, stored.shape, options.steps);
  GPUMemory<float> source(voxels.size());
  source.copy_from_host(voxels);
  GPUMatrix<float> positions(3, kBatch), values(1, kBatch);
  const float factor = stored.peak > 0.0f ? 1.0f / stored.peak : 0.0f;
  float loss = 0.0f;
  for (std::uint32_t step = 0; step < options.steps; ++step) {
    sample<<<kBlocks, kThreads>>>(gridOf(sides), source.data(), factor,
                                  std::uint64_t(step) * kBatch, positions.data(), values.data());
    CUDA_CHECK_THROW(cudaGetLastError());
    const auto context = model.trainer->training_step(positions, values);
    if (step + 1 == options.steps) loss = model.trainer->loss(*context);
  }
  const std::size_t count = model.network->n_params();
  stored.parameters = download(model.trainer->params_inference(), count);
  std::fprintf(
      stderr,
      "instant_ngp: %u levels of 2^%u entries, %u neurons, %zu parameters, %u steps, loss %g\n",
      stored.shape.levels, stored.shape.tableBits, stored.shape.neurons, count, options.steps,
      double(loss));
  return stored;
}

std::vector<float> evaluate(const Stored& stored) {
  Model model = makeModel(stored.sides, stored.shape, 1);
  if (model.network->n_params() != stored.parameters.size())
    throw std::runtime_error("the file has " + std::to_string(stored.parameters.size()) +
                             " parameters, and its shape " +
                             std::to_string(model.network->n_params()));
  model.trainer->set_params(reinterpret_cast<const Half*>(stored.parameters.data()),
                            stored.parameters.size(), false);
  GPUMatrix<float> positions(3, kBatch), values(1, kBatch);
  std::vector<float> voxels(voxelsOf(stored.sides));
  for (std::size_t first = 0; first < voxels.size(); first += kBatch) {
    enumerate<<<kBlocks, kThreads>>>(gridOf(stored.sides), first, positions.data());
    CUDA_CHECK_THROW(cudaGetLastError());
    model.network->inference(positions, values);
    const std::size_t count = std::min<std::size_t>(kBatch, voxels.size() - first);
    CUDA_CHECK_THROW(cudaMemcpy(voxels.data() + first, values.data(), count * sizeof(float),
                                cudaMemcpyDeviceToHost));
  }
  for (float& v : voxels) v *= stored.peak;
  return voxels;
}

}  // namespace ngp
