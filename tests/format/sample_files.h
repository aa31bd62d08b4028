#pragma once
/// Small deterministic files to encode, which are made without a fit, and their comparison bit by
/// bit.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::test {

/// The optional parts that the ellipsoids of a chunk have.
struct EllipsoidParts {
  bool rotations = true;
  bool kappas = false;
};

/// n ellipsoids spread over 64^3 voxels, with different parameters, already in the order of the
/// file.
[[nodiscard]] Ellipsoids sampleEllipsoids(std::size_t n, std::uint32_t seed,
                                          EllipsoidParts parts = {});

/// A fog volume with one chunk, metadata and a curve.
[[nodiscard]] StoredGrid fogGrid(std::size_t ellipsoids);

/// A level set with bricks, a double background, a frustum map (not affine) and no rotations.
[[nodiscard]] StoredGrid levelSetGrid(std::size_t ellipsoids);

/// Three chunks; the middle one is empty, and the last one has a kappa for each ellipsoid.
[[nodiscard]] StoredGrid chunkedGrid(std::size_t ellipsoidsPerChunk);

/// A fog volume with quantised ellipsoids in two chunks, the second one with signs.
[[nodiscard]] StoredGrid quantisedGrid(std::size_t ellipsoidsPerChunk);

/// The same in importance layers: four for each chunk if there are enough precisions.
[[nodiscard]] StoredGrid layeredGrid(std::size_t ellipsoidsPerChunk);

/// A grid with a background and nothing else.
[[nodiscard]] StoredGrid emptyGrid();

/// A carried grid with these bytes.
[[nodiscard]] CarriedGrid carriedGrid(std::uint32_t place, const std::string& bytes);

/// A file with all grids above, a grid that shares the data of the first one, two carried grids and
/// metadata.
[[nodiscard]] EsvrFile everything(std::size_t ellipsoids);

[[nodiscard]] EsvrFile fileOf(StoredGrid grid);

[[nodiscard]] std::vector<std::byte> bytesOf(const std::string& text);

/// Compares all members, floating-point numbers bit by bit. \return the name of the first that
/// differs, or ""
[[nodiscard]] std::string difference(const EsvrFile& a, const EsvrFile& b);

}  // namespace esvr::test
