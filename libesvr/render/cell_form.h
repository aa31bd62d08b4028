#pragma once
/// An ellipsoid as a decoder of bricks of cells reads it.

#include <cstdint>

#include "field/line_form.h"

namespace esvr {

struct alignas(16) CellForm {
  LineForm form;        ///< center relative to the origin of its chunk
  float halfZ;          ///< half width of the support's bounding box along z
  std::uint32_t chunk;  ///< number of its chunk
};

}  // namespace esvr
