// The extension module esvr._core. The package esvr (integrations/python/esvr) imports it.

#include "esvr/device.h"
#include "python/src/objects.h"

namespace {

constexpr const char* kModuleText =
    "Sparse volumes as lists of ellipsoids. All coordinates are those of the index space: voxel\n"
    "(i, j, k) lies at (i, j, k), and arrays have the axes x, y, z.";

}  // namespace

PYBIND11_MODULE(_core, module) {
  using namespace esvr::python;
  module.doc() = kModuleText;
  module.attr("__version__") = ESVR_VERSION;
  addErrors(module);
  addVolume(module);
  addPacked(module);
  addGrid(module);
  addFiles(module);
  addFit(module);
  addRender(module);
  addCompare(module);
}
