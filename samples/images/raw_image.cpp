#include <algorithm>
#include <fstream>
#include <system_error>
#include <vector>

#include "esvr/error.h"
#include "images/element_type.h"
#include "images/image_source.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

class RawImage : public ImageSource {
 public:
  RawImage(const fs::path& path, const RawLayout& layout)
      : path_(path),
        layout_(layout),
        type_(elementType(layout.type)),
        file_(path, std::ios::binary) {
    checkSize();
    checkLength();
    if (!file_) throw BadInput("cannot read " + path_.string());
  }

  [[nodiscard]] Coord size() const override { return layout_.size; }
  [[nodiscard]] std::optional<double> typeMaximum() const override { return type_.maximum; }
  [[nodiscard]] std::array<double, 16> indexToWorld() const override {
    return scaleMatrix(layout_.voxelSize);
  }

  void read(const Slab& slab, std::span<float> out) override {
    bytes_.resize(out.size() * type_.bytes);
    const std::uint64_t before = std::uint64_t(slab.firstZ) * sliceBytes();
    file_.seekg(std::streamoff(layout_.headerBytes + before));
    file_.read(reinterpret_cast<char*>(bytes_.data()), std::streamsize(bytes_.size()));
    if (!file_)
      throw BadInput(path_.string() + ": cannot be read at slice " + std::to_string(slab.firstZ));
    type_.decode({.bytes = bytes_, .bigEndian = layout_.bigEndian}, out);
  }

 private:
  [[nodiscard]] std::uint64_t sliceBytes() const {
    return std::uint64_t(layout_.size.x) * std::uint64_t(layout_.size.y) * type_.bytes;
  }

  void checkSize() const {
    if (std::min({layout_.size.x, layout_.size.y, layout_.size.z}) < 1)
      throw UsageError("an image of " + toString(layout_.size) + " voxels has none");
  }

  void checkLength() const {
    std::error_code error;
    const std::uint64_t length = fs::file_size(path_, error);
    if (error) throw BadInput("cannot read " + path_.string() + ": " + error.message());
    const double expected =
        double(layout_.size.z) * double(sliceBytes()) + double(layout_.headerBytes);
    if (layout_.endsWithData ? double(length) == expected : double(length) >= expected) return;
    throw BadInput(
        path_.string() + " has " + std::to_string(length) + " bytes; " + toString(layout_.size) +
        " voxels of " + type_.name + " after " + std::to_string(layout_.headerBytes) +
        " bytes of header need " +
        (expected < 0x1p63 ? std::to_string(std::uint64_t(expected)) : "more than 2^63"));
  }

  fs::path path_;
  RawLayout layout_;
  const ElementType& type_;
  std::ifstream file_;
  std::vector<std::byte> bytes_;
};

}  // namespace

std::unique_ptr<ImageSource> openRaw(const fs::path& path, const RawLayout& layout) {
  return std::make_unique<RawImage>(path, layout);
}

}  // namespace esvr::samples
