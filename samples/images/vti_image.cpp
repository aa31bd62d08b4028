#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "images/element_type.h"
#include "images/image_source.h"
#include "images/vti_data.h"
#include "images/vti_header.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

std::string textOf(const VtiArray& array) {
  return "'" + array.name + "' (" + std::to_string(array.components) + " x " + array.type +
         (array.ofCells ? ", cells)" : ", points)");
}

[[noreturn]] void refuseChoice(const fs::path& path, const std::string& what,
                               const std::vector<VtiArray>& arrays) {
  std::string list = arrays.empty() ? "it has no array" : "its arrays are ";
  for (const VtiArray& array : arrays)
    list += (&array == arrays.data() ? "" : ", ") + textOf(array);
  throw UsageError(path.string() + " " + what + "; " + list);
}

VtiArray namedArray(const fs::path& path, const VtiHeader& header, const std::string& name) {
  for (const VtiArray& array : header.arrays)
    if (array.name == name) return array;
  refuseChoice(path, "has no array '" + name + "'", header.arrays);
}

/// The only array, or the one that the file names as active.
VtiArray defaultArray(const fs::path& path, const VtiHeader& header) {
  if (header.arrays.size() == 1) return header.arrays.front();
  for (const VtiArray& array : header.arrays) {
    const std::string& active = array.ofCells ? header.activeOfCells : header.activeOfPoints;
    if (!active.empty() && array.name == active) return array;
  }
  refuseChoice(path, "has several arrays and none that is active, so that --dataset must name one",
               header.arrays);
}

VtiArray chosenArray(const fs::path& path, const VtiHeader& header, const ImageChoice& choice) {
  const VtiArray array =
      choice.dataset ? namedArray(path, header, *choice.dataset) : defaultArray(path, header);
  constexpr std::uint64_t kMost = 1 << 12;
  if (array.components < 1 || array.components > kMost)
    throw BadInput(path.string() + ": array " + textOf(array) +
                   " has an impossible number of components");
  return array;
}

/// Numbers of points or cells along the axes.
std::array<std::uint64_t, 3> lengthsOf(const VtiHeader& header, bool ofCells) {
  constexpr double kMost = 0x1p33;  // too many already, and exact
  std::array<std::uint64_t, 3> lengths{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cells = header.extent[2 * axis + 1] - header.extent[2 * axis];
    lengths[axis] = std::uint64_t(std::clamp(cells + (ofCells ? 0.0 : 1.0), 0.0, kMost));
  }
  return lengths;
}

class VtiImage : public ImageSource {
 public:
  VtiImage(const fs::path& path, const ImageChoice& choice)
      : path_(path),
        header_(readVtiHeader(path)),
        array_(chosenArray(path, header_, choice)),
        size_(checkedSize(path, lengthsOf(header_, array_.ofCells))) {
    selection_.component = chosenComponent(path, choice, array_.components);
    const double tuples = double(size_.x) * double(size_.y) * double(size_.z);
    if (tuples * double(array_.components) > 0x1p58)
      throw BadInput(path.string() + " has too many voxels");
    selection_.tuples = std::uint64_t(size_.x) * std::uint64_t(size_.y) * std::uint64_t(size_.z);
    named([&] { maximum_ = elementType(elementNameOf(array_)).maximum; });
    restart();
    requireSlabMemory(path, size_, array_.components * sizeof(double));
  }

  [[nodiscard]] Coord size() const override { return size_; }
  [[nodiscard]] std::optional<double> typeMaximum() const override { return maximum_; }

  /// The point i is at origin + direction * (spacing * i), and a cell half a spacing beyond.
  [[nodiscard]] std::array<double, 16> indexToWorld() const override {
    std::array<double, 16> matrix{};
    for (std::size_t world = 0; world < 3; ++world) {
      matrix[12 + world] = header_.origin[world];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double step = header_.direction[world * 3 + axis] * header_.spacing[axis];
        matrix[axis * 4 + world] = step;
        matrix[12 + world] += step * (header_.extent[2 * axis] + (array_.ofCells ? 0.5 : 0.0));
      }
    }
    matrix[15] = 1.0;
    return matrix;
  }

  void read(const Slab& slab, std::span<float> out) override {
    if (slab.firstZ < nextZ_) restart();
    const std::size_t area = std::size_t(size_.x) * std::size_t(size_.y);
    named([&] {
      for (; nextZ_ < slab.firstZ; ++nextZ_) data_->read(out.first(area));
      data_->read(out);
    });
    nextZ_ += slab.slices;
  }

 private:
  /// Runs a step and adds the file to the text of its error.
  template <class Step>
  void named(const Step& step) const try {
    step();
  } catch (const BadInput& error) {
    throw BadInput("cannot read " + path_.string() + ": array '" + array_.name +
                   "': " + error.what());
  }

  void restart() {
    named([&] { data_ = openVtiData(path_, header_, array_, selection_); });
    nextZ_ = 0;
  }

  fs::path path_;
  VtiHeader header_;
  VtiArray array_;
  Coord size_;
  VtiSelection selection_;
  std::optional<double> maximum_;
  std::unique_ptr<VtiData> data_;
  std::int32_t nextZ_ = 0;
};

}  // namespace

std::unique_ptr<ImageSource> openVti(const fs::path& path, const ImageChoice& choice) {
  return std::make_unique<VtiImage>(path, choice);
}

}  // namespace esvr::samples
