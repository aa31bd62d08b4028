// esvr.fit.

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <algorithm>

#include "esvr/convert.h"
#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "python/src/interruptible.h"

namespace esvr::python {
namespace {

template <class Value>
struct Word {
  const char* word;
  Value value;
};

template <class Value, std::size_t n>
Value valueOf(const char* argument, const std::string& text, const Word<Value> (&words)[n]) {
  std::string known;
  for (const auto& w : words) {
    if (text == w.word) return w.value;
    known += (known.empty() ? "" : ", ") + std::string(w.word);
  }
  throw UsageError(std::string(argument) + " is one of " + known + ", not '" + text + "'");
}

constexpr Word<Preset> kPresets[] = {
    {"draft", Preset::kDraft}, {"standard", Preset::kStandard}, {"high", Preset::kHigh}};
constexpr Word<Representation> kRepresentations[] = {{"auto", Representation::kAuto},
                                                     {"ellipsoids", Representation::kEllipsoids},
                                                     {"voxels", Representation::kVoxels}};
constexpr Word<Storage> kStorages[] = {{"compact", Storage::kCompact},
                                       {"float32", Storage::kFloat32}};

/// The goals of which one may be given.
struct Goals {
  std::optional<double> psnr, maxError;
  std::optional<std::uint64_t> size;
  std::optional<std::size_t> count;
  bool lossless = false;
};

Goal goalOf(const Goals& g) {
  const int given = g.psnr.has_value() + g.maxError.has_value() + g.size.has_value() +
                    g.count.has_value() + g.lossless;
  if (given > 1) throw UsageError("psnr, max_error, size, count and lossless exclude each other");
  if (g.psnr) return PsnrGoal{*g.psnr};
  if (g.maxError) return BoundGoal{.bound = *g.maxError};
  if (g.size) return SizeGoal{*g.size};
  if (g.lossless) return LosslessGoal{};
  if (g.count) return FitGoal{};
  return PresetGoal{};
}

using Progress = std::function<void(double)>;

/// Calls a function of Python with the share that is done. An exception of it ends the fit; it is
/// kept, because it must not leave the thread of the fit.
class Reporter {
 public:
  Reporter(const Progress& progress, CancelToken& token) : progress_(progress), token_(token) {}

  void operator()(const FitProgress& state) {
    const py::gil_scoped_acquire acquire;
    if (raised_) return;
    try {
      progress_(state.fraction);
    } catch (...) {
      raised_ = std::current_exception();
      token_.cancel();
    }
  }
  void rethrow() const {
    if (raised_) std::rethrow_exception(raised_);
  }

 private:
  const Progress& progress_;
  CancelToken& token_;
  std::exception_ptr raised_;
};

Conversion convertWith(const Volume& volume, ConvertOptions options, CancelToken& token) {
  options.fit.cancel = &token;
  const VolumeGrid& source = *volume.grid;
  return convertVolume({source.descriptor, source.volume}, options);
}

Grid fitVolume(const Volume& volume, const ConvertOptions& options, const Progress& progress) {
  CancelToken token;
  Reporter reporter(progress, token);
  ConvertOptions reporting = options;
  if (progress) reporting.fit.progress = std::ref(reporter);
  auto running = std::async(std::launch::async, [&] {
    const CancelScope scope(&token);
    return convertWith(volume, std::move(reporting), token);
  });
  Conversion conversion;
  try {
    conversion = waitFor(running, token);
  } catch (const Cancelled&) {
    reporter.rethrow();
    throw;
  }
  reporter.rethrow();
  if (conversion.fit.end == FitEnd::kPsnrMissed)
    throw TargetMissed("grid '" + shownName(volume.grid->descriptor.name) +
                       "': the PSNR is out of reach");
  return {std::make_shared<const StoredGrid>(std::move(conversion.grid))};
}

/// Warns of what a grid without loss does not hold.
void tellLostValues(const Volume& volume) {
  const InactiveValues& inactive = volume.grid->inactive;
  if (inactive.count() == 0) return;
  const std::string text = "grid '" + volume.grid->descriptor.name + "' loses " + toText(inactive) +
                           "; the program vdb2esvr keeps them with --lossless or --keep";
  if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set();
}

constexpr const char* kFitText =
    "Converts a volume to a Grid. One of the goals may be given:\n\n"
    "psnr: the smallest grid of this PSNR over the box, dB; max_error: a bound on the error of\n"
    "every voxel; size: the best grid of this number of bytes; count: a number of ellipsoids;\n"
    "lossless: every active voxel bit for bit. The default is the quality of the preset ('draft',\n"
    "'standard' or 'high'), over the active voxels.\n\n"
    "representation: 'auto', 'ellipsoids' or 'voxels'. storage: 'compact' or 'float32'. device:\n"
    "'auto', 'cpu', 'cuda' or 'cuda:N'. progress: is called with the share of the running fit "
    "that\n"
    "is done, 0 to 1; a conversion may make several fits. Ctrl-C ends the call.";

}  // namespace

void addFit(py::module_& module) {
  module.def(
      "fit",
      [](const Volume& volume, std::optional<double> psnr, std::optional<double> maxError,
         std::optional<std::uint64_t> size, std::optional<std::size_t> count, bool lossless,
         const std::string& preset, const std::string& representation, const std::string& storage,
         const std::string& device, std::uint64_t seed, const Progress& progress) {
        ConvertOptions options;
        options.goal = goalOf({psnr, maxError, size, count, lossless});
        options.representation = valueOf("representation", representation, kRepresentations);
        options.storage.form = valueOf("storage", storage, kStorages);
        options.fit.preset = valueOf("preset", preset, kPresets);
        options.fit.count = count;
        options.fit.seed = seed;
        options.fit.device = selectDevice(device);
        if (lossless) tellLostValues(volume);
        return fitVolume(volume, options, progress);
      },
      py::arg("volume"), py::kw_only(), py::arg("psnr") = py::none(),
      py::arg("max_error") = py::none(), py::arg("size") = py::none(),
      py::arg("count") = py::none(), py::arg("lossless") = false, py::arg("preset") = "standard",
      py::arg("representation") = "auto", py::arg("storage") = "compact",
      py::arg("device") = "auto", py::arg("seed") = 1, py::arg("progress") = py::none(), kFitText);
}

}  // namespace esvr::python
