#pragma once
/// Files to encode: small, deterministic, made without a fit. And their comparison, bit by bit.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::test {

/// Which of the optional parts a chunk's ellipsoids have.
struct EllipsoidParts {
  bool rotations = true;
  bool kappas = false;
};

/// n ellipsoids spread over 64^3 voxels, all parameters different, in the file's order already.
[[nodiscard]] Ellipsoids sampleEllipsoids(std::size_t n, std::uint32_t seed,
                                          EllipsoidParts parts = {});

/// A fog volume of one chunk with metadata and a curve.
[[nodiscard]] StoredGrid fogGrid(std::size_t ellipsoids);

/// A level set with leaves, double background, frustum map (no affine), no rotations.
[[nodiscard]] StoredGrid levelSetGrid(std::size_t ellipsoids);

/// Three chunks, the middle one empty, the last with a kappa for each ellipsoid.
[[nodiscard]] StoredGrid chunkedGrid(std::size_t ellipsoidsPerChunk);

/// A fog volume whose ellipsoids are quantised, in two chunks, the second with signs.
[[nodiscard]] StoredGrid quantisedGrid(std::size_t ellipsoidsPerChunk);

/// The same in importance layers, four a chunk where there are so many precisions.
[[nodiscard]] StoredGrid layeredGrid(std::size_t ellipsoidsPerChunk);

/// A grid with a background and nothing else.
[[nodiscard]] StoredGrid emptyGrid();

/// All of the above and metadata of the file.
[[nodiscard]] EsvrFile everything(std::size_t ellipsoids);

[[nodiscard]] EsvrFile fileOf(StoredGrid grid);

[[nodiscard]] std::vector<std::byte> bytesOf(const std::string& text);

/// Every member equal, floating-point numbers bit by bit; names the first that differs, else "".
[[nodiscard]] std::string difference(const EsvrFile& a, const EsvrFile& b);

}  // namespace esvr::test
