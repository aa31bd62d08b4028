#pragma once
/// The inner loops over one (ellipsoid, brick) pair, compiled once per instruction set and chosen
/// at run time. A brick's voxels are rows of eight along z; lanes are z, the loop runs along y, so
/// that an ellipsoid's line form (line_form.h) gives m by one multiply-add a row.

#include <vector>

#include "esvr/kernel.h"
#include "field/line_form.h"

namespace esvr {

/// The values that one pair left behind for its backward pass.
struct PairTape {
  float* phi;             ///< rows of phi, in loop order; 64-byte aligned
  int xBegin, xEnd;       ///< slices visited
  signed char yBegin[8];  ///< rows visited in each slice, [yBegin, yEnd)
  signed char yEnd[8];
  int floats;  ///< length of phi
};

/// Sums over a pair's voxels, r the loss's gradient by V, phi' the derivative by m, d the
/// displacement and t the distance along y to the closest approach.
struct PairMoments {
  float w0x, w0z, w0xx, w0xz, w0zz;  ///< sum r phi' {dx, dz, dx dx, dx dz, dz dz}
  float w1, w1x, w1z;                ///< sum r phi' t {1, dx, dz}
  float w2;                          ///< sum r phi' t t
  float rPhi;                        ///< sum r phi
  float phi2;                        ///< sum phi phi
  float rEdge;                       ///< sum r (phi + base)(1 - phi): by kappa, over slope
};

/// The two of them that need no derivative.
struct PairProjection {
  float rPhi, phi2;
};

struct BrickKernels {
  const char* name;
  /// sum[512] += intensity * phi. `corner`: the brick's first voxel in the frame of f.center.
  void (*add)(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
              float* sum);
  /// The same, and leaves phi on the tape. tape.phi must have room for 512 floats.
  void (*forward)(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
                  float* sum, PairTape& tape);
  /// \param r  gradient of the loss by V at the brick's voxels
  void (*backward)(const LineForm& f, const float corner[3], const KernelConstants<float>& k,
                   const float* r, const PairTape& tape, PairMoments& moments);
  /// forward() and backward() from the tape alone, to the bit, while shapes stay as they were.
  void (*addTape)(const PairTape& tape, float intensity, float* sum);
  void (*projectTape)(const PairTape& tape, const float* r, PairProjection& projection);
};

/// The sets this processor runs, the best first.
[[nodiscard]] std::vector<const BrickKernels*> runnableKernels();

/// The best set this processor runs.
[[nodiscard]] const BrickKernels& brickKernels();

}  // namespace esvr
