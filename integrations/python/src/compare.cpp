// esvr.compare.

#include <pybind11/stl.h>

#include <variant>

#include "esvr/metrics.h"
#include "python/src/interruptible.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

using Side = std::variant<Volume, Grid>;

Volume voxelsOf(const Side& side) {
  if (const auto* volume = std::get_if<Volume>(&side)) return *volume;
  return decoded(std::get<Grid>(side), std::nullopt);
}

VolumeMetrics compare(const Side& reference, const Side& candidate,
                      const std::optional<PlainBox>& box, std::optional<double> peak, bool ssim) {
  const Volume a = voxelsOf(reference), b = voxelsOf(candidate);
  CompareOptions options{.peak = peak, .ssim = ssim};
  if (box) options.box = boxOf(*box);
  return interruptible([&] { return compareVolumes(a.grid->volume, b.grid->volume, options); });
}

}  // namespace

void addCompare(py::module_& module) {
  using M = VolumeMetrics;
  py::class_<M>(module, "Metrics", "Errors of a volume against a reference.")
      .def_readonly("psnr_box", &M::psnrBox, "dB over the box; infinite without an error.")
      .def_readonly("psnr_active", &M::psnrActive, "dB over the active voxels of the reference.")
      .def_readonly("mse_box", &M::mseBox)
      .def_readonly("mse_active", &M::mseActive)
      .def_readonly("max_error", &M::maxError, "Largest absolute error over the box.")
      .def_readonly("p999_error", &M::p999Error,
                    "99.9th percentile of the absolute error over the active voxels of both.")
      .def_readonly("iou", &M::iou, "Intersection over union of the active voxels.")
      .def_readonly("peak", &M::peak, "Peak of the PSNR.")
      .def_readonly("ssim", &M::ssim, "3D SSIM over the box, if it was asked for.")
      .def("__repr__", [](const M& m) {
        return py::str(
                   "<esvr.Metrics: {:.2f} dB over the box, {:.2f} dB over the active voxels, "
                   "largest error {:.4g}>")
            .format(m.psnrBox, m.psnrActive, m.maxError);
      });
  module.def(
      "compare", &compare, py::arg("reference"), py::arg("candidate"), py::kw_only(),
      py::arg("box") = py::none(), py::arg("peak") = py::none(), py::arg("ssim") = false,
      "Compares two volumes or grids; grids are decoded. The box is that of the reference's\n"
      "active voxels by default, and the peak the range of its values, which is the largest value\n"
      "of a density (docs/compare.md).");
}

}  // namespace esvr::python
