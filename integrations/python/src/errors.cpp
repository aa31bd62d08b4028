#include "esvr/error.h"

#include "python/src/objects.h"

namespace esvr::python {
namespace {

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

}  // namespace

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

}  // namespace esvr::python
