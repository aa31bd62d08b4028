// The extension module esvr._core, its errors, and esvr.compare. The package esvr
// (integrations/python/esvr) imports it.

#include <pybind11/stl.h>

#include <variant>

#include "esvr/device.h"
#include "esvr/did_you_mean.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

// Errors.

/// The classes of Python's exceptions. They live as long as the interpreter, which is why the
/// module keeps references that it never drops.
struct Classes {
  PyObject *error, *usage, *input, *target, *device, *memory, *cancelled;
};

PyObject* add(py::module_& module, const char* name, const py::tuple& bases, const char* text) {
  const std::string qualified = std::string("esvr.") + name;
  PyObject* made = PyErr_NewExceptionWithDoc(qualified.c_str(), text, bases.ptr(), nullptr);
  if (!made) throw py::error_already_set();
  module.add_object(name, py::reinterpret_borrow<py::object>(made));
  return made;
}

py::tuple bases(PyObject* first, PyObject* second) {
  return py::make_tuple(py::handle(first), py::handle(second));
}

Classes makeClasses(py::module_& module) {
  Classes c{};
  c.error = add(module, "Error", py::make_tuple(py::handle(PyExc_RuntimeError)),
                "The base of all errors of this module.");
  c.usage = add(module, "UsageError", bases(c.error, PyExc_ValueError), "An argument is invalid.");
  c.input =
      add(module, "BadInput", bases(c.error, PyExc_ValueError),
          "A file or a volume cannot be used; the text names the file, the grid and the voxel.");
  c.target = add(module, "TargetMissed", py::make_tuple(py::handle(c.error)),
                 "A quality was not reached.");
  c.device = add(module, "DeviceError", py::make_tuple(py::handle(c.error)),
                 "The GPU is missing or has too little memory.");
  c.memory = add(module, "MemoryExceeded", bases(c.error, PyExc_MemoryError),
                 "The input needs more memory than is allowed.");
  c.cancelled = add(module, "Cancelled", py::make_tuple(py::handle(c.error)),
                    "The call was cancelled before it had a result.");
  return c;
}

PyObject* classOf(const Classes& c, const Error& error) {
  if (dynamic_cast<const Cancelled*>(&error)) return c.cancelled;
  if (dynamic_cast<const MemoryExceeded*>(&error)) return c.memory;
  switch (error.kind()) {
    case ErrorKind::kUsage:
      return c.usage;
    case ErrorKind::kBadInput:
      return c.input;
    case ErrorKind::kTargetMissed:
      return c.target;
    case ErrorKind::kDevice:
      return c.device;
    case ErrorKind::kRuntime:
      break;
  }
  return c.error;
}

void addErrors(py::module_& module) {
  // A translator is a plain function, so that what it needs cannot be captured.
  static const Classes classes = makeClasses(module);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      PyErr_SetString(classOf(classes, error), error.what());
    }
  });
}

// esvr.compare.

using Side = std::variant<Volume, Grid>;

Volume voxelsOf(const Side& side) {
  if (const auto* volume = std::get_if<Volume>(&side)) return *volume;
  return decoded(std::get<Grid>(side), std::nullopt);
}

VolumeMetrics compare(const Side& reference, const Side& candidate,
                      const std::optional<PlainBox>& box, std::optional<double> peak, bool ssim) {
  const Volume a = voxelsOf(reference), b = voxelsOf(candidate);
  CompareOptions options{
      .peak = peak,
      .ssim = ssim,
      .transmittance = isLookedThrough(a.grid->descriptor.gridClass, a.grid->volume)};
  if (box) options.box = boxOf(*box);
  return interruptible([&] { return compareVolumes(a.grid->volume, b.grid->volume, options); });
}

/// A figure of the transmittance; None for a reference that is not looked through.
template <auto Member>
std::optional<double> light(const VolumeMetrics& m) {
  return m.transmittance ? std::optional((*m.transmittance).*Member) : std::nullopt;
}

void addCompare(py::module_& module) {
  using M = VolumeMetrics;
  py::class_<M>(module, "Metrics", "Errors of a volume against a reference.")
      .def_readonly("psnr_box", &M::psnrBox, "dB over the box; infinite without an error.")
      .def_readonly("psnr_active", &M::psnrActive, "dB over the active voxels of the reference.")
      .def_property_readonly("psnr_t90", &light<&TransmittancePsnr::psnr90>,
                             "dB of the transmittance, where the median column lets 90 % of the\n"
                             "light through; None where the reference is not looked through.")
      .def_property_readonly("psnr_t50", &light<&TransmittancePsnr::psnr50>, "The same with 50 %.")
      .def_property_readonly("psnr_t10", &light<&TransmittancePsnr::psnr10>, "The same with 10 %.")
      .def_property_readonly("median_depth", &light<&TransmittancePsnr::medianDepth>,
                             "Sum of the values of the reference's median column.")
      .def_readonly("mse_box", &M::mseBox, "Mean squared error over the box.")
      .def_readonly("mse_active", &M::mseActive,
                    "Mean squared error over the active voxels of the reference.")
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

}  // namespace
}  // namespace esvr::python

PYBIND11_MODULE(_core, module) {
  using namespace esvr::python;
  module.doc() =
      "Sparse volumes as lists of ellipsoids. All coordinates are those of the index space: voxel\n"
      "(i, j, k) lies at (i, j, k), and arrays have the axes x, y, z.";
  module.attr("__version__") = ESVR_VERSION;
  module.def("_did_you_mean", [](const std::string& given, const std::vector<std::string>& known) {
    return esvr::didYouMean(given, known);
  });
  addErrors(module);
  addVolume(module);
  addPacked(module);
  addGrid(module);
  addFiles(module);
  addFit(module);
  addRender(module);
  addSplats(module);
  addCompare(module);
  addPickling(module);
}
