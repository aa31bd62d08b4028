// esvr.Grid and esvr.Ellipsoids, and esvr.fit and esvr.convert, which make grids and files.

#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <exception>
#include <functional>
#include <span>
#include <variant>

#include "esvr/convert_file.h"
#include "esvr/did_you_mean.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/resolution.h"
#include "python/src/objects.h"

namespace esvr::python {
namespace {

/// Copies the ellipsoids of a chunk to row `first` and those after it.
void copyChunk(const Chunk& chunk, float kappa, py::ssize_t first, Ellipsoids& to) {
  const auto& e = chunk.ellipsoids;
  const double origin[3] = {double(chunk.origin.x), double(chunk.origin.y), double(chunk.origin.z)};
  for (std::size_t i = 0; i < e.size(); ++i) {
    const auto row = first + py::ssize_t(i);
    for (int a = 0; a < 3; ++a) {
      to.mu.mutable_at(row, a) = origin[a] + double(e.center[a][i]);
      to.scale.mutable_at(row, a) = std::exp(e.logScale[a][i]);
    }
    for (int a = 0; a < 4; ++a) to.quaternion.mutable_at(row, a) = e.rotation[a][i];
    to.intensity.mutable_at(row) = e.intensity[i];
    to.kappa.mutable_at(row) = e.kappa.empty() ? kappa : e.kappa[i];
  }
}

/// The arrays refuse to be written: they are not the ellipsoids of the grid but show them.
template <class T>
void makeReadOnly(py::array_t<T>& array) {
  array.attr("setflags")(py::arg("write") = false);
}

Ellipsoids ellipsoidsOf(const Grid& self) {
  const Field& field = self.grid->field;
  const auto n = py::ssize_t(field.ellipsoidCount());
  Ellipsoids all{py::array_t<double>({n, py::ssize_t(3)}), py::array_t<float>({n, py::ssize_t(3)}),
                 py::array_t<float>({n, py::ssize_t(4)}), py::array_t<float>(n),
                 py::array_t<float>(n)};
  all.epsilon = field.kernel.epsilon;
  py::ssize_t first = 0;
  for (const Chunk& chunk : field.chunks) {
    copyChunk(chunk, field.kernel.kappa, first, all);
    first += py::ssize_t(chunk.ellipsoids.size());
  }
  makeReadOnly(all.mu);
  makeReadOnly(all.scale);
  makeReadOnly(all.quaternion);
  makeReadOnly(all.intensity);
  makeReadOnly(all.kappa);
  return all;
}

using Places = py::array_t<double, py::array::c_style | py::array::forcecast>;

py::array_t<float> evaluate(const Grid& self, const Places& points) {
  static_assert(sizeof(Place) == 3 * sizeof(double));
  if (points.ndim() != 2 || points.shape(1) != 3)
    throw UsageError("points must have the shape (n, 3)");
  const StoredGrid& grid = *self.grid;
  if (!followsFromEllipsoids(grid))
    throw UsageError(
        "grid '" + shownName(grid.descriptor.name) +
        "' stores voxels, a residual or NaN, so that there is no sum to evaluate; decode it "
        "with to_volume()");
  py::array_t<float> values(points.shape(0));
  const std::span places(reinterpret_cast<const Place*>(points.data()),
                         std::size_t(points.shape(0)));
  const std::span out(values.mutable_data(), places.size());
  interruptible([&] {
    evaluatePlaces(grid.field, places, out);
    const auto range = voxelRule(grid).range;
    for (float& value : out) {
      value = grid.tone.value(value);
      if (range) value = std::clamp(value, range->min, range->max);
    }
  });
  return values;
}

std::string kindOf(const StoredGrid& grid) {
  if (grid.voxels) return "voxels";
  return grid.residual ? "ellipsoids with a residual" : "ellipsoids";
}

void addEllipsoids(py::module_& module) {
  py::class_<Ellipsoids>(
      module, "Ellipsoids",
      "The ellipsoids of a grid as arrays that cannot be written.\n\n"
      "An ellipsoid adds intensity * phi(m) with m = |S^-1 R^T (x - mu)|^2, where\n"
      "S is the diagonal matrix of its scale, R the matrix of its quaternion, and\n"
      "phi the kernel with the edge kappa.")
      .def_readonly("mu", &Ellipsoids::mu, "Centers, voxels: float64 of shape (n, 3).")
      .def_readonly("scale", &Ellipsoids::scale, "Scales, voxels: float32 of shape (n, 3).")
      .def_readonly("quaternion", &Ellipsoids::quaternion,
                    "Unit quaternions w, x, y, z: float32 of shape (n, 4).")
      .def_readonly("intensity", &Ellipsoids::intensity,
                    "Intensities in units of the values: float32 of shape (n,).")
      .def_readonly("kappa", &Ellipsoids::kappa, "Edges of the kernel: float32 of shape (n,).")
      .def_readonly("epsilon", &Ellipsoids::epsilon,
                    "The kernel ends where (1 + E) / (E + e^m) falls to it, with E = e^kappa.")
      .def(
          "__len__", [](const Ellipsoids& e) { return e.intensity.size(); },
          "The number of ellipsoids.")
      .def("__repr__", [](const Ellipsoids& e) {
        return "<esvr.Ellipsoids: " + std::to_string(e.intensity.size()) + ">";
      });
}

}  // namespace

SavedResolution resolutionOf(const py::object& coarsen, const std::optional<double>& voxelSize) {
  if (voxelSize && !coarsen.is_none())
    throw UsageError("coarsen and voxel_size exclude each other");
  if (voxelSize && !(*voxelSize > 0.0)) throw UsageError("voxel_size must be above 0");
  if (coarsen.is_none()) return {.voxelSize = voxelSize};
  if (py::isinstance<py::str>(coarsen) && coarsen.cast<std::string>() == "auto")
    return {.isAuto = true};
  if (PyIndex_Check(coarsen.ptr()) != 0 && !py::isinstance<py::bool_>(coarsen))
    for (const int factor : {2, 4, 8})
      if (coarsen.equal(py::int_(factor))) return {.coarsen = factor};
  throw UsageError("coarsen is 2, 4, 8 or 'auto', not " + py::repr(coarsen).cast<std::string>());
}

double factorOf(const Transform& transform, const SavedResolution& wish) {
  return wish.voxelSize ? factorFor(transform, *wish.voxelSize) : double(wish.coarsen);
}

Volume decoded(const Grid& grid, const std::optional<PlainBox>& box,
               const std::optional<std::uint64_t>& maxMemory, const SavedResolution& resolution) {
  DecodeOptions options{.maxBytes = memoryLimit(maxMemory)};
  if (box) options.box = boxOf(*box);
  if (options.box && options.box->empty()) throw UsageError("the box is empty");
  return interruptible([&] {
    return atResolution(resolution, [&](const SavedResolution& chosen) {
      const double factor = factorOf(grid.grid->descriptor.transform, chosen);
      return Volume{
          std::make_shared<const VolumeGrid>(decodeAtResolution(*grid.grid, factor, options))};
    });
  });
}

void addGrid(py::module_& module) {
  addEllipsoids(module);
  py::class_<Grid> type(module, "Grid", "A grid of an .esvr file: a sum of ellipsoids, or voxels.");
  addDescriptor(type);
  type.def(
          "to_volume",
          [](const Grid& grid, const std::optional<PlainBox>& box,
             const std::optional<std::uint64_t>& maxMemory, const py::object& coarsen,
             std::optional<double> voxelSize) {
            return decoded(grid, box, maxMemory, resolutionOf(coarsen, voxelSize));
          },
          py::arg("box") = py::none(), py::kw_only(), py::arg("max_memory") = py::none(),
          py::arg("coarsen") = py::none(), py::arg("voxel_size") = py::none(),
          "Decodes the voxels, or those in a box ((x0, y0, z0), (x1, y1, z1)), both inclusive.\n"
          "max_memory is that of esvr.read. coarsen is 2, 4 or 8, by which the edges of voxels "
          "become\n"
          "longer, each with the average of what is in it, or 'auto': the least of 1, 2, 4 and 8 "
          "with\n"
          "which the voxels fit into max_memory. voxel_size is the length of their shortest edge\n"
          "instead, in units of the world, and may be shorter than in the source for ellipsoids. "
          "The\n"
          "box is in voxels of the source.")
      .def("evaluate", &evaluate, py::arg("points"),
           "The sum of the ellipsoids at points of shape (n, 3), in index coordinates: float32 of\n"
           "shape (n,). A fit constrains it at voxels only.")
      .def_property_readonly("ellipsoids", &ellipsoidsOf, "The ellipsoids (esvr.Ellipsoids).")
      .def_property_readonly(
          "ellipsoid_count", [](const Grid& g) { return g.grid->field.ellipsoidCount(); },
          "Number of ellipsoids; 0 if the grid stores voxels.")
      .def_property_readonly(
          "kind", [](const Grid& g) { return kindOf(*g.grid); },
          "\"ellipsoids\", \"ellipsoids with a residual\" or \"voxels\".")
      .def_property_readonly(
          "background", [](const Grid& g) { return float(g.grid->descriptor.background); },
          "The value where no voxel is active.")
      .def_property_readonly(
          "active_voxels", [](const Grid& g) { return g.grid->activeVoxels; },
          "Number of active voxels of the source.")
      .def_property_readonly(
          "box", [](const Grid& g) { return plainBox(g.grid->activeBox); },
          "The first and the last active voxel of the source along each axis.")
      .def_property_readonly(
          "value_range",
          [](const Grid& g) { return std::pair(g.grid->valueMin, g.grid->valueMax); },
          "The smallest and the largest finite active value of the source.")
      .def_property_readonly(
          "nonfinite", [](const Grid& g) { return g.grid->nonFinite.total(); },
          "Number of active voxels of the source that are NaN or infinite, and come back so.")
      .def_property_readonly(
          "tone",
          [](const Grid& g) {
            return g.grid->tone.isOn() ? std::optional(g.grid->tone.scale) : std::nullopt;
          },
          "The scale s of the tone curve: values are s sinh(sum / s); None without one.")
      .def_property_readonly(
          "bytes", [](const Grid& g) { return bytesAdded(*g.grid); },
          "Largest number of bytes that the grid adds to a file.");
}

// esvr.fit and esvr.convert.

namespace {

template <class Value>
struct Word {
  const char* word;
  Value value;
};

template <class Value, std::size_t n>
Value valueOf(const char* argument, const std::string& text, const Word<Value> (&words)[n]) {
  std::string known;
  std::vector<std::string> all;
  for (const auto& w : words) {
    if (text == w.word) return w.value;
    known += (known.empty() ? "" : ", ") + std::string(w.word);
    all.emplace_back(w.word);
  }
  throw UsageError(std::string(argument) + " is one of " + known + ", not '" + text + "'" +
                   didYouMean(text, all));
}

constexpr Word<Preset> kPresets[] = {
    {"draft", Preset::kDraft}, {"standard", Preset::kStandard}, {"high", Preset::kHigh}};
constexpr Word<Representation> kRepresentations[] = {{"auto", Representation::kAuto},
                                                     {"ellipsoids", Representation::kEllipsoids},
                                                     {"voxels", Representation::kVoxels}};
constexpr Word<Measure> kMeasures[] = {{"auto", Measure::kAuto}, {"values", Measure::kValues}};
constexpr Word<Storage> kStorages[] = {{"compact", Storage::kCompact},
                                       {"float32", Storage::kFloat32}};

/// The goals of which one may be given.
struct Goals {
  std::optional<double> psnr, picturePsnr, maxError, maxRelativeError, relativeFloor;
  std::optional<std::uint64_t> size;
  std::optional<std::size_t> count;
  bool lossless = false;
};

Goal goalOf(const Goals& g) {
  const int given = g.psnr.has_value() + g.picturePsnr.has_value() + g.maxError.has_value() +
                    g.maxRelativeError.has_value() + g.size.has_value() + g.count.has_value() +
                    g.lossless;
  if (given > 1)
    throw UsageError(
        "psnr, picture_psnr, max_error, max_relative_error, size, count and lossless exclude each "
        "other");
  if (g.relativeFloor && !g.maxRelativeError)
    throw UsageError("relative_floor belongs to max_relative_error");
  if (g.psnr) return PsnrGoal{*g.psnr};
  if (g.picturePsnr) return PictureGoal{*g.picturePsnr};
  if (g.maxError) return BoundGoal{.bound = *g.maxError};
  if (g.maxRelativeError) return RelativeBoundGoal{*g.maxRelativeError, g.relativeFloor};
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

/// The result of `work`, which gets the options with progress. Ctrl-C and an exception of `progress` end it.
template <class Work>
auto reporting(ConvertOptions options, const Progress& progress, const Work& work) {
  CancelToken token;
  Reporter reporter(progress, token);
  if (progress) options.fit.progress = std::ref(reporter);
  options.fit.cancel = &token;
  auto running = std::async(std::launch::async, [&] {
    const CancelScope scope(&token);
    return work(options);
  });
  try {
    auto result = waitFor(running, token);
    reporter.rethrow();
    return result;
  } catch (const Cancelled&) {
    reporter.rethrow();
    throw;
  }
}

void requirePsnr(const Conversion& made) {
  if (made.fit.end == FitEnd::kPsnrMissed)
    throw TargetMissed("grid '" + shownName(made.grid.descriptor.name) +
                       "': the PSNR is out of reach");
}

Grid fitVolume(const Volume& volume, const ConvertOptions& options, const Progress& progress) {
  const VolumeGrid& source = *volume.grid;
  Conversion made = reporting(options, progress, [&](const ConvertOptions& given) {
    return convertVolume({source.descriptor, source.volume}, given);
  });
  requirePsnr(made);
  return {std::make_shared<const StoredGrid>(std::move(made.grid))};
}

/// What esvr.convert takes: a file, or volumes.
using ConvertedSource = std::variant<std::filesystem::path, std::vector<Volume>>;

bool isLossless(const ConvertOptions& options) {
  return std::holds_alternative<LosslessGoal>(options.goal);
}

/// Refuses volumes with voxels that are not finite, unless they are to be kept.
void requireFinite(const Volume& volume, NonFinite nonFinite) {
  if (nonFinite != NonFinite::kKeep && hasNonFinite(volume.grid->volume))
    throw BadInput("grid '" + shownName(volume.grid->descriptor.name) +
                   "' has voxels that are not finite; nonfinite='keep' keeps them");
}

FileSource sourceOf(const ConvertedSource& given, bool lossless, NonFinite nonFinite) {
  if (const auto* path = std::get_if<std::filesystem::path>(&given))
    return readSources(*path, lossless, {.nonFinite = nonFinite, .maxBytes = usualMemoryLimit()});
  FileSource source;
  for (const auto& [grid, rounded] : std::get<std::vector<Volume>>(given)) {
    const std::uint64_t active = activeVoxelCount(grid->volume);
    source.grids.push_back({.name = grid->descriptor.name,
                            .place = source.grids.size(),
                            .activeVoxels = active,
                            .storedBytes = active * sizeof(float),
                            .activeBox = activeBox(grid->volume),
                            .read = [grid = grid] { return *grid; }});
  }
  return source;
}

File convertSource(const ConvertedSource& given, const ConvertOptions& options, NonFinite nonFinite,
                   const Progress& progress) try {
  ConvertedFile made = reporting(options, progress, [&](const ConvertOptions& common) {
    FileOptions ofFile{.convert = common};
    if (const auto* size = std::get_if<SizeGoal>(&common.goal)) ofFile.size = size->bytes;
    const auto* path = std::get_if<std::filesystem::path>(&given);
    const auto convert = [&] {
      return convertGrids(sourceOf(given, isLossless(common), nonFinite), ofFile);
    };
    return path ? namingFile(path->string(), convert) : convert();
  });
  if (made.interrupted) throw Cancelled();
  if (std::holds_alternative<PsnrGoal>(options.goal))  // a preset is as good as the grids allow
    for (const GridConversion& grid : made.grids) requirePsnr(grid.conversion);
  return {std::make_shared<const EsvrFile>(std::move(made.file))};
} catch (const NotFinite& error) {
  throw BadInput(error.what() + std::string("; nonfinite='keep' stores where they are"));
}

/// Warns of what a grid without loss does not hold.
void tellLostValues(const Volume& volume) {
  const InactiveValues& inactive = volume.grid->inactive;
  if (inactive.count() == 0) return;
  const std::string text = "grid '" + shownName(volume.grid->descriptor.name) + "' loses " +
                           toText(inactive) +
                           "; the program vdb2esvr keeps them with --lossless or --keep";
  if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), kCaller) != 0) throw py::error_already_set();
}

constexpr const char* kFitText = "Converts a volume to a Grid. ";

constexpr const char* kConvertText =
    "Converts all grids of a .vdb or .nvdb file, or a list of volumes, to a File, as vdb2esvr "
    "does:\n"
    "grids of equal voxels once, vectors, grids that are carried unchanged, and voxels that refer "
    "to\n"
    "those of a grid that is like them. size is that of the file. ";

constexpr const char* kGoalText =
    "One of the goals may be given:\n\n"
    "psnr: the smallest grid of this PSNR over the box, dB; max_error: a bound on the error of\n"
    "every voxel; size: the best grid of this number of bytes; count: a number of ellipsoids;\n"
    "lossless: every active voxel bit for bit; picture_psnr: the smallest grid whose "
    "transmittance\n"
    "has this PSNR (Metrics.psnr_t50), of a volume that is looked through; max_relative_error: a\n"
    "bound on the error of every voxel relative to its magnitude, such as 0.01, or to "
    "relative_floor\n"
    "where that is larger (default: the smallest magnitude above 0, at least 1.2e-38). The "
    "default\n"
    "is the quality of the preset ('draft', 'standard' or 'high').\n\n"
    "measure: what the quality of a preset and of a size means. 'auto': what is seen of a volume "
    "that\n"
    "is looked through, the surface of a level set that is no narrow band, and the PSNR of values\n"
    "otherwise; 'values': the PSNR of values.\n"
    "tone: the scale of the tone curve; None: it is chosen where the measure is what is seen; 0: "
    "none.\n"
    "effort: how long the conversion may take, from 1 to 9.\n"
    "nonfinite: 'refuse' NaN and infinite voxels, or 'keep' them: they come back where they were, "
    "and\n"
    "the goal and all errors are those of the other voxels.\n"
    "representation: 'auto', 'ellipsoids' or 'voxels'. storage: 'compact' or 'float32'. device:\n"
    "'auto', 'cpu', 'cuda' or 'cuda:N'. progress: is called with the share of the running fit "
    "that\n"
    "is done, 0 to 1; a conversion may make several fits. Ctrl-C ends the call.";

}  // namespace

namespace {

/// Defines a function that makes a Grid or a File for a goal.
template <class Source, class Convert>
void defineConversion(py::module_& module, const char* name, const char* source, const char* text,
                      const Convert& convertFrom) {
  module.def(
      name,
      [convertFrom](const Source& from, std::optional<double> psnr,
                    std::optional<double> picturePsnr, std::optional<double> maxError,
                    std::optional<double> maxRelativeError, std::optional<double> relativeFloor,
                    std::optional<std::uint64_t> size, std::optional<std::size_t> count,
                    bool lossless, const std::string& preset, const std::string& measure,
                    std::optional<float> tone, int effort, const std::string& representation,
                    const std::string& storage, const std::string& nonFinite,
                    const std::string& device, std::uint64_t seed, const Progress& progress) {
        ConvertOptions options;
        options.goal = goalOf(
            {psnr, picturePsnr, maxError, maxRelativeError, relativeFloor, size, count, lossless});
        options.measure = valueOf("measure", measure, kMeasures);
        if (tone && !(std::isfinite(*tone) && *tone >= 0.0f))
          throw UsageError("tone is a scale above 0, or 0 for no tone curve");
        if (tone && *tone > 0.0f && (lossless || maxError || maxRelativeError))
          throw UsageError("a tone curve has no bound on the error of a voxel");
        if (tone) options.tone = ToneCurve{*tone};
        options.representation = valueOf("representation", representation, kRepresentations);
        options.storage.form = valueOf("storage", storage, kStorages);
        options.fit.preset = valueOf("preset", preset, kPresets);
        if (effort < kLeastEffort || effort > kMostEffort)
          throw UsageError("effort must be from 1 to 9");
        options.effort = effort;
        options.fit.count = count;
        options.fit.seed = seed;
        options.fit.device = selectDevice(device);
        return convertFrom(from, options, nonFiniteOf(nonFinite), progress);
      },
      py::arg(source), py::kw_only(), py::arg("psnr") = py::none(),
      py::arg("picture_psnr") = py::none(), py::arg("max_error") = py::none(),
      py::arg("max_relative_error") = py::none(), py::arg("relative_floor") = py::none(),
      py::arg("size") = py::none(), py::arg("count") = py::none(), py::arg("lossless") = false,
      py::arg("preset") = "standard", py::arg("measure") = "auto", py::arg("tone") = py::none(),
      py::arg("effort") = kUsualEffort, py::arg("representation") = "auto",
      py::arg("storage") = "compact", py::arg("nonfinite") = "refuse", py::arg("device") = "auto",
      py::arg("seed") = 1, py::arg("progress") = py::none(),
      (std::string(text) + kGoalText).c_str());
}

}  // namespace

void addFit(py::module_& module) {
  defineConversion<Volume>(module, "fit", "volume", kFitText,
                           [](const Volume& volume, const ConvertOptions& options,
                              NonFinite nonFinite, const Progress& progress) {
                             requireFinite(volume, nonFinite);
                             if (isLossless(options)) tellLostValues(volume);
                             return fitVolume(volume, options, progress);
                           });
  defineConversion<ConvertedSource>(
      module, "convert", "source", kConvertText,
      [](const ConvertedSource& source, const ConvertOptions& options, NonFinite nonFinite,
         const Progress& progress) {
        if (const auto* volumes = std::get_if<std::vector<Volume>>(&source); volumes)
          for (const Volume& volume : *volumes) {
            requireFinite(volume, nonFinite);
            if (isLossless(options)) tellLostValues(volume);
          }
        return convertSource(source, options, nonFinite, progress);
      });
}

}  // namespace esvr::python
