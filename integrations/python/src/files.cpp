// esvr.File and esvr.Sequence: reading, writing, and saving as VDB.

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <mutex>
#include <span>
#include <variant>

#include "esvr/did_you_mean.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/resolution.h"
#include "esvr/sequence_file.h"
#include "python/src/objects.h"

namespace esvr::python {

// The grids of a file.

namespace {

/// A grid of a file, which keeps the whole file in memory.
Grid gridOf(const File& self, std::size_t index) {
  return {std::shared_ptr<const StoredGrid>(self.file, &self.file->grids[index])};
}

std::vector<Grid> gridsOf(const File& self) {
  std::vector<Grid> grids;
  for (std::size_t g = 0; g < self.file->grids.size(); ++g) grids.push_back(gridOf(self, g));
  return grids;
}

/// The names of the grids, separated by commas.
std::string listed(const File& self) {
  std::string names;
  for (const auto& name : namesOfStored(*self.file)) names += (names.empty() ? "" : ", ") + name;
  return names;
}

Grid gridNamed(const File& self, const std::string& name) {
  try {
    return gridOf(self, findStored(*self.file, name));
  } catch (const BadInput& error) {
    const GridNames all(namesInOrder(*self.file));
    if (all.isAmbiguous(name) || all.lookUp(name))
      throw py::key_error("the file " + std::string(error.what()));
    throw py::key_error("there is no grid '" + shownName(name) + "'; there are: " + listed(self) +
                        didYouMean(name, all.allUnique(), "'"));
  }
}

std::vector<std::string> carriedNames(const File& self) {
  std::vector<std::string> names;
  for (const auto& grid : self.file->carried) names.push_back(grid.name);
  return names;
}

}  // namespace

// Reading and writing.

namespace {

/// A part of a file that is read.
struct Part {
  std::optional<PlainBox> box;
  std::optional<std::size_t> ellipsoids;
  std::optional<std::int64_t> frame;
  ReadLimits limits{};

  [[nodiscard]] bool isWhole() const { return !box && !ellipsoids; }
};

EsvrFile readFrame(const std::filesystem::path& path, const Part& part) {
  if (!part.isWhole())
    throw UsageError(path.string() + ": frames of a sequence are read as a whole");
  return SequenceReader(path, part.limits).read(*part.frame);
}

EsvrFile readPart(const std::filesystem::path& path, const Part& part) {
  if (part.frame) return readFrame(path, part);
  if (holdsSequence(path))
    throw UsageError(path.string() + ": the file holds a sequence; name a frame (esvr.frames)");
  if (part.isWhole()) return readEsvr(path, part.limits);
  ReadPart wanted{.ellipsoids = part.ellipsoids, .limits = part.limits};
  if (part.box) wanted.box = boxOf(*part.box);
  return readEsvrPart(path, wanted).file;
}

File read(const std::filesystem::path& path, const std::optional<PlainBox>& box,
          const std::optional<std::size_t>& ellipsoids, const std::optional<std::int64_t>& frame,
          const std::optional<std::uint64_t>& maxMemory) {
  return interruptible([&] {
    const ReadLimits limits{.maxBytes = memoryLimit(maxMemory)};
    return File{std::make_shared<const EsvrFile>(readPart(path, {box, ellipsoids, frame, limits}))};
  });
}

std::vector<std::int64_t> numbersOf(const SequenceReader& reader) {
  std::vector<std::int64_t> numbers;
  for (const auto& frame : reader.frames()) numbers.push_back(frame.number);
  return numbers;
}

std::vector<std::int64_t> framesOf(const std::filesystem::path& path) {
  return interruptible([&]() -> std::vector<std::int64_t> {
    if (!holdsSequence(path)) return {};
    return numbersOf(SequenceReader(path));
  });
}

/// A reader that threads of Python may share.
struct Sequence {
  Sequence(const std::filesystem::path& file, std::uint64_t limit)
      : path(file), maxBytes(limit), reader(path, {.maxBytes = maxBytes}) {}

  std::filesystem::path path;
  std::uint64_t maxBytes;
  SequenceReader reader;
  std::mutex reads;
};

File readOfSequence(Sequence& self, std::int64_t frame) {
  return interruptible([&] {
    const std::lock_guard lock(self.reads);
    return File{std::make_shared<const EsvrFile>(self.reader.read(frame))};
  });
}

std::uint64_t writeFile(const std::filesystem::path& path, const File& file, bool overwrite) {
  return interruptible([&] { return writeEsvr(path, *file.file, {.overwrite = overwrite}); });
}

std::uint64_t writeGridList(const std::filesystem::path& path, const std::vector<Grid>& grids,
                            bool overwrite) {
  return interruptible([&] {
    EsvrFile file;
    for (const Grid& grid : grids) {
      file.grids.push_back(*grid.grid);
      // The other grid may not be there. It only made the voxels smaller.
      file.grids.back().reference.reset();
    }
    return writeEsvr(path, file, {.overwrite = overwrite});
  });
}

}  // namespace

// Saving as VDB.

namespace {

/// A part of the content of a file that is saved as VDB.
struct SavedPart {
  std::optional<PlainBox> box;
  std::optional<std::size_t> layers, maxEllipsoids;
  SavedResolution resolution{};

  [[nodiscard]] bool isWhole() const {
    return !box && !layers && !maxEllipsoids && resolution.coarsen == 1 && !resolution.voxelSize;
  }
};

using Decoded = std::variant<VolumeGrid, VectorGrid>;

StoredGrid cut(StoredGrid grid, const SavedPart& part) {
  if (part.layers) grid = firstLayers(std::move(grid), *part.layers);
  if (part.maxEllipsoids) grid = heaviest(std::move(grid), *part.maxEllipsoids);
  return grid;
}

DecodeOptions decodeOptions(const SavedPart& part) {
  if (part.layers == 0u) throw UsageError("layers must be above 0");
  if (part.maxEllipsoids == 0u) throw UsageError("max_ellipsoids must be above 0");
  DecodeOptions options{.maxBytes = usualMemoryLimit()};
  if (part.box) options.box = boxOf(*part.box);
  if (options.box && options.box->empty()) throw UsageError("the box is empty");
  return options;
}

Decoded decode(const EsvrFile& file, const GridOfFile& grid, const SavedPart& part) {
  const DecodeOptions options = decodeOptions(part);
  if (!grid.isVector) {
    const StoredGrid& stored = file.grids[grid.index];
    const double factor = factorOf(stored.descriptor.transform, part.resolution);
    return decodeAtResolution(cut(stored, part), factor, options);
  }
  const StoredVector& vector = file.vectors[grid.index];
  std::vector<StoredGrid> parts;
  for (const StoredGrid& component : componentsOf(file, vector))
    parts.push_back(cut(component, part));
  const double factor = factorOf(parts.front().descriptor.transform, part.resolution);
  return decodeVectorAtResolution(vector.name, std::span(parts).first<kComponents>(), factor,
                                  options);
}

/// The grids that are written, in their order, and the names of the others.
struct Chosen {
  std::vector<GridOfFile> grids;
  std::vector<std::string> leftOut;
};

Chosen choose(const EsvrFile& file, const SavedPart& part) {
  Chosen chosen;
  for (const GridOfFile& grid : gridsInOrder(file))
    if (grid.isCarried && !part.isWhole())
      chosen.leftOut.push_back(nameOf(file, grid));
    else
      chosen.grids.push_back(grid);
  if (chosen.grids.empty() && !chosen.leftOut.empty())
    throw BadInput("no grid is left to write, because carried grids cannot be cut");
  return chosen;
}

/// \param decoded  those of the grids that are not carried
std::vector<GridToWrite> inOrder(const EsvrFile& file, const std::vector<GridOfFile>& grids,
                                 const std::vector<Decoded>& decoded) {
  std::vector<GridToWrite> all;
  auto next = decoded.begin();
  for (const GridOfFile& grid : grids)
    if (grid.isCarried)
      all.emplace_back(&file.carried[grid.index]);
    else
      all.push_back(std::visit([](const auto& g) { return GridToWrite(&g); }, *next++));
  return all;
}

/// What is written of a file.
struct Saved {
  Chosen chosen;
  std::vector<Decoded> decoded;  ///< the grids that are not carried
};

/// \throws MemoryExceeded  the grids together take too much. They are there twice more while they are written.
void requireTogether(const EsvrFile& file, const SavedPart& part) {
  constexpr double kCopies = 3.0;
  const DecodeOptions options = decodeOptions(part);
  double bytes = 0.0;
  for (const StoredGrid& grid : file.grids)
    bytes += kCopies * double(bytesAtResolution(grid, part.resolution.coarsen, options).result);
  requireWithinMemory(bytes, options.maxBytes, "the grids of the file at this resolution");
}

Saved decodeAll(const EsvrFile& file, const SavedPart& part) {
  Saved saved{choose(file, part), {}};
  for (const GridOfFile& grid : saved.chosen.grids)
    if (!grid.isCarried) saved.decoded.push_back(decode(file, grid, part));
  return saved;
}

/// Whether carried grids get coarser voxels. With finer ones, voxels have no values between them.
bool coarsensCarried(const EsvrFile& file, const SavedPart& part) {
  const bool isCut = part.box || part.layers || part.maxEllipsoids;
  if (file.carried.empty() || isCut) return false;
  if (!part.resolution.voxelSize) return part.resolution.coarsen > 1;
  return !file.grids.empty() && std::ranges::all_of(file.grids, [&](const StoredGrid& grid) {
    return factorOf(grid.descriptor.transform, part.resolution) >= 1.0;
  });
}

/// Writes the voxels of all grids of a file to a .vdb or .nvdb file.
/// \return the names of the carried grids that were left out because they cannot be cut
/// \throws UsageError  the box is empty, or a number is 0
/// \throws BadInput  all grids would be left out
std::vector<std::string> saveFile(const File& self, const std::filesystem::path& path,
                                  const SavedPart& part, bool overwrite) {
  EsvrFile coarser;  // with voxels in place of carried grids, once it is needed
  const EsvrFile* file = nullptr;
  const Saved saved = atResolution(part.resolution, [&](const SavedResolution& resolution) {
    SavedPart chosen = part;
    chosen.resolution = resolution;
    file = self.file.get();
    if (coarsensCarried(*file, chosen)) {
      if (coarser.grids.empty())
        coarser = withCarriedAsVoxels(*file, {.maxBytes = usualMemoryLimit()});
      file = &coarser;
    }
    if (part.resolution.isAuto) requireTogether(*file, chosen);
    return decodeAll(*file, chosen);
  });
  writeGrids(path, file->metadata, inOrder(*file, saved.chosen.grids, saved.decoded),
             {.overwrite = overwrite});
  return saved.chosen.leftOut;
}

}  // namespace

// The module's part.

void addFiles(py::module_& module) {
  py::class_<File>(module, "File", "The content of an .esvr file.")
      .def_property_readonly("grids", &gridsOf, "The grids in their order (list of esvr.Grid).")
      .def_property_readonly(
          "names", [](const File& self) { return namesOfStored(*self.file); },
          "The names by which file[name] finds each of the grids. They are unique, unlike "
          "Grid.name:\n"
          "\"density[1]\" is the second grid of a name, \"vel.x\" a component of the vectors "
          "\"vel\".")
      .def_property_readonly("carried", &carriedNames,
                             "Names of the grids that are kept as the bytes of their .vdb file.")
      .def("__getitem__", &gridNamed, py::arg("name"),
           "The grid of a name, as --grid of the programs finds it. KeyError: there is none, or\n"
           "several grids have the name; one of File.names tells them apart.")
      .def(
          "save",
          [](const File& file, const std::filesystem::path& path,
             const std::optional<PlainBox>& box, const std::optional<std::size_t>& layers,
             const std::optional<std::size_t>& maxEllipsoids, const py::object& coarsen,
             std::optional<double> voxelSize, bool overwrite) {
            const SavedPart part{box, layers, maxEllipsoids, resolutionOf(coarsen, voxelSize)};
            return interruptible([&] { return saveFile(file, path, part, overwrite); });
          },
          py::arg("path"), py::kw_only(), py::arg("box") = py::none(),
          py::arg("layers") = py::none(), py::arg("max_ellipsoids") = py::none(),
          py::arg("coarsen") = py::none(), py::arg("voxel_size") = py::none(),
          py::arg("overwrite") = false,
          "Writes the voxels of all grids to a .vdb or .nvdb file, as esvr2vdb does.\n\n"
          "box ((x0, y0, z0), (x1, y1, z1)), layers and max_ellipsoids are --bbox, --lod and\n"
          "--max-ellipsoids of esvr2vdb; coarsen and voxel_size are those of Grid.to_volume. With\n"
          "one of them, carried grids are left out if they cannot be cut or have no coarser "
          "voxels. "
          "Returns\nthe names of the grids that were left out.")
      .def(
          "__len__", [](const File& f) { return f.file->grids.size(); }, "The number of grids.")
      .def("__repr__", [](const File& f) { return describe(f); });
  py::class_<Sequence>(
      module, "Sequence",
      "A file that holds a sequence. Reading its frames in their order decodes each\n"
      "of them once; esvr.read(path, frame=...) decodes those before it again.")
      .def(py::init([](const std::filesystem::path& path,
                       const std::optional<std::uint64_t>& maxMemory) {
             const py::gil_scoped_release release;
             return std::make_unique<Sequence>(path, memoryLimit(maxMemory));
           }),
           py::arg("path"), py::kw_only(), py::arg("max_memory") = py::none(),
           "max_memory is that of esvr.read.")
      .def_property_readonly(
          "frames", [](const Sequence& s) { return numbersOf(s.reader); },
          "The numbers of the frames, which increase.")
      .def("read", &readOfSequence, py::arg("frame"), "Reads a frame (esvr.File).")
      .def("__reduce__",
           [](const Sequence& s) {
             const py::object opened = py::module_::import("functools")
                                           .attr("partial")(py::type::of<Sequence>(), s.path,
                                                            py::arg("max_memory") = s.maxBytes);
             return py::make_tuple(opened, py::tuple());
           })
      .def("__repr__", [](const Sequence& s) {
        return "<esvr.Sequence '" + shownText(s.path.string(), LineEnds::kReplace) +
               "': " + std::to_string(s.reader.frames().size()) + " frames, " +
               std::to_string(s.reader.fileBytes()) + " bytes>";
      });
  module.def(
      "read", &read, py::arg("path"), py::kw_only(), py::arg("box") = py::none(),
      py::arg("ellipsoids") = py::none(), py::arg("frame") = py::none(),
      py::arg("max_memory") = py::none(),
      "Reads an .esvr file, or a part of it.\n\n"
      "box selects the ellipsoids that reach ((x0, y0, z0), (x1, y1, z1)); ellipsoids is the\n"
      "number that a level of detail should have at least; frame is one of esvr.frames(path).\n"
      "max_memory is a limit on the bytes that the content may take in memory, which may be many\n"
      "times those of the file (default: half of the memory of the machine); above it, a\n"
      "MemoryError is raised.");
  module.def("frames", &framesOf, py::arg("path"),
             "The numbers of the frames of a sequence; an empty list for a file of one frame.");
  module.def("write", &writeFile, py::arg("path"), py::arg("file"), py::kw_only(),
             py::arg("overwrite") = false, "Writes a file. Returns the number of bytes.");
  module.def("write", &writeGridList, py::arg("path"), py::arg("grids"), py::kw_only(),
             py::arg("overwrite") = false, "Writes a file of these grids.");
}

}  // namespace esvr::python
