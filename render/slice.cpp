#include "render/slice.h"

namespace esvr::render {

PlaceBox sliceBox(std::size_t axis, double place) {
  constexpr double kEverywhere = 1e9;  // voxels; larger than any coordinate in a grid
  PlaceBox box{{-kEverywhere, -kEverywhere, -kEverywhere}, {kEverywhere, kEverywhere, kEverywhere}};
  box.low[axis] = place - 0.5, box.high[axis] = place + 0.5;
  return box;
}

}  // namespace esvr::render
