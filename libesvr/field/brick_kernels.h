#pragma once
/// The inner loops over one pair of an ellipsoid and a brick, or of an ellipsoid and places in a
/// brick. They are compiled once for each instruction set and chosen at run time. A SIMD vector holds
/// one row of eight voxels along z, or two rows that follow each other along y. The rows of a pair
/// that the support meets are the bits of one integer, so that a pair is a single loop over them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "esvr/ellipsoids.h"
#include "field/line_form.h"

namespace esvr {

/// The values that the forward pass over a pair records for the backward pass.
struct PairTape {
  float* phi;          ///< vectors of phi, in the order of the bits of `rows`; 64-byte aligned
  std::uint64_t rows;  ///< the visited vectors: bit 8 y + x, or 4 y + x for even y with two rows
  int floats;          ///< length of phi
};

/// Sums over a pair's voxels. r is the derivative of the loss by V, phi' the derivative of phi by
/// m, (dx, dy, dz) the displacement from the center, and t the distance along y from the point of
/// the line that is closest to the center.
struct PairMoments {
  float w0x, w0z, w0xx, w0xz, w0zz;  ///< sum r phi' {dx, dz, dx dx, dx dz, dz dz}
  float w1, w1x, w1z;                ///< sum r phi' t {1, dx, dz}
  float w2;                          ///< sum r phi' t t
  float rPhi;                        ///< sum r phi
  float phi2;                        ///< sum phi phi
  float rEdge;                       ///< sum r (phi + base) (1 - phi): derivative by kappa / slope
};

/// Sums of the members of PairMoments, in their order.
using MomentTotals = std::array<double, sizeof(PairMoments) / sizeof(float)>;

/// The two sums that a solve for the intensities needs.
struct PairProjection {
  float rPhi, phi2;
};

struct BrickKernels {
  const char* name;
  /// Adds intensity * phi to the kBrickVoxels values of `sum`.
  /// \param corner  first voxel of the brick, in the frame of f.center
  void (*add)(const BrickForm& f, const float corner[3], const KernelConstants<float>& k,
              float* sum);
  /// Does the same and records phi on the tape. tape.phi must have room for kBrickVoxels floats.
  void (*forward)(const BrickForm& f, const float corner[3], const KernelConstants<float>& k,
                  float* sum, PairTape& tape);
  /// Computes the moments. \param r  derivative of the loss by V at the brick's voxels
  void (*backward)(const BrickForm& f, const float corner[3], const KernelConstants<float>& k,
                   const float* r, const PairTape& tape, PairMoments& moments);
  /// Computes the two sums of PairProjection, which are among those of backward().
  void (*project)(const PairTape& tape, const float* r, PairProjection& projection);
  /// Starts the residuals of a brick: r = -target.
  void (*start)(const float* target, float* r);
  /// Replaces r = V - target by clamp(V, low, high) - target.
  /// \return sum of r^2: in float32 in each lane, and in float64 over the lanes
  double (*finish)(const float* target, float low, float high, float* r);
  /// Sums moments in float64, in their order.
  void (*sumMoments)(const PairMoments* moments, std::size_t count, MomentTotals& sums);
};

/// The kernels for all instruction sets that this processor has, the best first.
[[nodiscard]] std::vector<const BrickKernels*> runnableKernels();

/// The kernels for the best instruction set of this processor.
[[nodiscard]] const BrickKernels& brickKernels();

/// Places in a brick, relative to its first voxel. The arrays are 64-byte aligned.
struct PlaceBlock {
  static constexpr int kMultiple = 16;  ///< `count` is a multiple of it, which fills all registers

  const float *x, *y, *z;
  int count;
};

/// Adds intensity * phi to the sum of each place. This is not one of the BrickKernels, so that a program
/// that evaluates no places does not contain the loop.
/// \param corner  first voxel of the brick, in the frame of f.center
using AddPlaces = void (*)(const BrickForm& f, const float corner[3],
                           const KernelConstants<float>& k, const PlaceBlock& places, float* sum);

/// The loops for all instruction sets that this processor has, in the order of runnableKernels().
[[nodiscard]] std::vector<AddPlaces> runnablePlaceKernels();

/// The loop for the best instruction set of this processor.
[[nodiscard]] AddPlaces placeKernel();

}  // namespace esvr
