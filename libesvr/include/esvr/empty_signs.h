#pragma once
/// The sign of a level set where it has no bricks. A level set is negative inside its surface; 0 is
/// outside. The space without bricks consists of regions: two bricks' places belong to the same
/// region if a path leads from one to the other through faces of places without a brick.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Finds the regions of a volume's empty space and their signs. A region has the sign of the voxels
/// of the bricks around it that touch it. Memory and time follow the number of bricks and not the
/// bounding box.
class EmptySigns {
 public:
  explicit EmptySigns(const SparseVolume& volume);

  /// True if the voxels around every region agree in their sign, and those around the region that
  /// reaches infinity are outside. If they do not, the surface has holes in the empty space, and
  /// nothing says which side is inside.
  [[nodiscard]] bool agree() const { return agree_; }

  /// True if the place of a brick lies in a region inside the surface. Where voxels do not agree,
  /// most of them decide. The region that reaches infinity is always outside.
  /// \param brick  index corner / 8 of a place without a brick
  [[nodiscard]] bool isInside(Coord brick) const;

 private:
  /// Places without a brick between two bricks of a line along z.
  struct Gap {
    std::int32_t first = 0, last = 0;      ///< z
    std::size_t region = 0;                ///< a gap of the same region, or itself; see rootOf()
    std::int64_t inside = 0, outside = 0;  ///< voxels around the region, by their sign
  };
  /// The bricks of a line along z, and the gaps between them.
  struct Line {
    std::int32_t x = 0, y = 0, first = 0, last = 0;
    std::size_t gapsBegin = 0, gapsEnd = 0;
  };

  void findGaps(const SparseVolume& volume);
  void joinGaps();
  void join(std::size_t gap, const Line* beside);
  void unite(std::size_t a, std::size_t b);
  void countFaces(const SparseVolume& volume);
  void judge();
  [[nodiscard]] std::size_t rootOf(std::size_t gap) const;
  [[nodiscard]] const Line* lineAt(std::int32_t x, std::int32_t y) const;
  [[nodiscard]] std::size_t firstGapFrom(const Line& line, std::int32_t z) const;
  [[nodiscard]] std::size_t gapAt(Coord brick) const;

  Coord origin_;             ///< of the volume, in bricks
  std::vector<Gap> gaps_;    ///< the first one stands for everything beside and beyond the lines
  std::vector<Line> lines_;  ///< increasing
  bool agree_ = true;
};

}  // namespace esvr
