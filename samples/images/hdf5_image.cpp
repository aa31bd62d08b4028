#include <algorithm>

#include "cli/memory.h"
#include "esvr/error.h"
#include "images/hdf5_file.h"
#include "images/image_source.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kVolumeAxes = 3;

/// Leaves out leading axes of length 1, as long as there are more than three.
std::vector<std::uint64_t> usedAxes(const Hdf5Dataset& dataset) {
  auto begin = dataset.axes.begin();
  while (dataset.axes.end() - begin > std::ptrdiff_t(kVolumeAxes) && *begin == 1) ++begin;
  return {begin, dataset.axes.end()};
}

std::string listOf(const std::vector<Hdf5Dataset>& datasets) {
  constexpr std::size_t kMost = 20;
  if (datasets.empty()) return "it has no dataset";
  std::string list = "its datasets are ";
  for (std::size_t i = 0; i < std::min(kMost, datasets.size()); ++i)
    list += (i ? ", " : "") + textOf(datasets[i]);
  const std::size_t more = datasets.size() - std::min(kMost, datasets.size());
  return list + (more ? " and " + std::to_string(more) + " more" : "");
}

Hdf5Dataset namedDataset(const fs::path& path, const std::vector<Hdf5Dataset>& datasets,
                         const std::string& name) {
  for (const Hdf5Dataset& dataset : datasets)
    if (dataset.path == name || dataset.path == "/" + name) return dataset;
  throw UsageError(path.string() + " has no dataset '" + name + "'; " + listOf(datasets));
}

Hdf5Dataset onlyVolume(const fs::path& path, const std::vector<Hdf5Dataset>& datasets) {
  const auto isVolume = [](const Hdf5Dataset& dataset) {
    return dataset.isOfNumbers() && usedAxes(dataset).size() == kVolumeAxes;
  };
  if (std::ranges::count_if(datasets, isVolume) == 1)
    return *std::ranges::find_if(datasets, isVolume);
  throw UsageError(path.string() +
                   " has not exactly one dataset of numbers with three axes, so that --dataset "
                   "must name one; " +
                   listOf(datasets));
}

Hdf5Dataset chosenDataset(const fs::path& path, const Hdf5File& file, const ImageChoice& choice) {
  const auto datasets = file.datasets();
  return choice.dataset ? namedDataset(path, datasets, *choice.dataset)
                        : onlyVolume(path, datasets);
}

/// The roles of a dataset's axes, which are counted from the slowest one on.
struct Hdf5Axes {
  std::size_t z = 0;
  std::optional<std::size_t> component;
};

Hdf5Axes axesOf(const fs::path& path, const Hdf5Dataset& dataset) {
  const auto used = usedAxes(dataset);
  const std::size_t left = dataset.axes.size() - used.size();
  if (dataset.isOfNumbers() && used.size() == kVolumeAxes) return {left, std::nullopt};
  if (!dataset.isOfNumbers() || used.size() != kVolumeAxes + 1)
    throw BadInput(path.string() + ": " + textOf(dataset) +
                   " is no volume of numbers, which has three axes, or four with components");
  if (used.front() < used.back()) return {left + 1, left};
  return {left, left + kVolumeAxes};
}

class Hdf5Image : public ImageSource {
 public:
  Hdf5Image(const fs::path& path, const ImageChoice& choice)
      : path_(path),
        file_(path),
        dataset_(chosenDataset(path, file_, choice)),
        axes_(axesOf(path, dataset_)) {
    const auto& lengths = dataset_.axes;
    size_ = checkedSize(path, {lengths[axes_.z + 2], lengths[axes_.z + 1], lengths[axes_.z]});
    component_ = chosenComponent(path, choice, axes_.component ? lengths[*axes_.component] : 1);
    requireSlabMemory(path, size_, 0);  // the library converts in small parts
    opened_ = file_.open(dataset_, cacheBytes());
  }

  [[nodiscard]] Coord size() const override { return size_; }
  [[nodiscard]] std::optional<double> typeMaximum() const override { return dataset_.maximum; }
  [[nodiscard]] std::array<double, 16> indexToWorld() const override {
    return scaleMatrix(elementSize(opened_).value_or(std::array{1.0, 1.0, 1.0}));
  }

  void read(const Slab& slab, std::span<float> out) override {
    std::vector<hsize_t> first(dataset_.axes.size(), 0), count(dataset_.axes.size(), 1);
    first[axes_.z] = hsize_t(slab.firstZ);
    count[axes_.z] = hsize_t(slab.slices);
    count[axes_.z + 1] = hsize_t(size_.y);
    count[axes_.z + 2] = hsize_t(size_.x);
    if (axes_.component) first[*axes_.component] = component_;
    const Hdf5Handle from(H5Dget_space(opened_.id()), H5Sclose);
    H5Sselect_hyperslab(from.id(), H5S_SELECT_SET, first.data(), nullptr, count.data(), nullptr);
    // With the same axes as the selection, the library copies rows instead of single numbers.
    const Hdf5Handle to(H5Screate_simple(int(count.size()), count.data(), nullptr), H5Sclose);
    if (H5Dread(opened_.id(), H5T_NATIVE_FLOAT, to.id(), from.id(), H5P_DEFAULT, out.data()) < 0)
      file_.fail(dataset_.path + " at slice " + std::to_string(slab.firstZ));
  }

 private:
  /// Holds all compressed parts that a slice meets, so that each is decompressed once. Where they
  /// do not fit into a quarter of the memory, they are decompressed again for each slab.
  [[nodiscard]] std::size_t cacheBytes() const {
    constexpr double kLeast = 1 << 20;
    const double most = double(cli::availableMemory()) / 4.0;
    const double wanted = chunkBytesOfPlane(file_.open(dataset_, 0), dataset_.axes, axes_.z);
    return std::size_t(std::max(kLeast, std::min(wanted, most)));
  }

  fs::path path_;
  Hdf5File file_;
  Hdf5Dataset dataset_;
  Hdf5Axes axes_;
  Coord size_;
  std::size_t component_ = 0;
  Hdf5Handle opened_;
};

}  // namespace

std::unique_ptr<ImageSource> openHdf5(const fs::path& path, const ImageChoice& choice) {
  return std::make_unique<Hdf5Image>(path, choice);
}

}  // namespace esvr::samples
