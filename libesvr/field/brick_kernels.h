#pragma once
/// The inner loops over one pair of an ellipsoid and a brick, or of an ellipsoid and places in a brick.
/// They are compiled once for each
/// instruction set and chosen at run time. A SIMD vector holds a row of eight voxels along z, and
/// the loop runs along y. In the line form of an ellipsoid (line_form.h), m then takes one
/// multiply-add for each row.

#include <vector>

#include "esvr/ellipsoids.h"
#include "field/line_form.h"

namespace esvr {

/// The values that the forward pass over a pair records for the backward pass.
struct PairTape {
  float* phi;             ///< rows of phi, in loop order; 64-byte aligned
  int xBegin, xEnd;       ///< visited slices: xBegin to xEnd - 1
  signed char yBegin[8];  ///< visited rows of each slice: yBegin to yEnd - 1
  signed char yEnd[8];
  int floats;  ///< length of phi
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

/// The two sums that a solve for the intensities needs.
struct PairProjection {
  float rPhi, phi2;
};

struct BrickKernels {
  const char* name;
  /// Adds intensity * phi to the kBrickVoxels values of `sum`.
  /// \param corner  first voxel of the brick, in the frame of f.center
  void (*add)(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
              float* sum);
  /// Does the same and records phi on the tape. tape.phi must have room for kBrickVoxels floats.
  void (*forward)(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
                  float* sum, PairTape& tape);
  /// Computes the moments. \param r  derivative of the loss by V at the brick's voxels
  void (*backward)(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
                   const float* r, const PairTape& tape, PairMoments& moments);
  /// Have the same results as forward() and backward(), bit by bit, but read phi from the tape of
  /// an earlier forward pass with the same shapes.
  void (*addTape)(const PairTape& tape, float intensity, float* sum);
  void (*projectTape)(const PairTape& tape, const float* r, PairProjection& projection);
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
using AddPlaces = void (*)(const LineForm& f, const float corner[3],
                           const KernelConstants<float>& k, const PlaceBlock& places, float* sum);

/// The loops for all instruction sets that this processor has, in the order of runnableKernels().
[[nodiscard]] std::vector<AddPlaces> runnablePlaceKernels();

/// The loop for the best instruction set of this processor.
[[nodiscard]] AddPlaces placeKernel();

}  // namespace esvr
