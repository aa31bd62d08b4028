#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <limits>
#include <system_error>
#include <type_traits>
#include <vector>

#include "esvr/error.h"
#include "images/image_source.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little,
              "values are swapped for big-endian files");

/// Converts the bytes of values of one type to floats.
using Convert = void (*)(std::span<std::byte> bytes, bool swap, std::span<float> out);

template <class T>
void convertAs(std::span<std::byte> bytes, bool swap, std::span<float> out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::byte* at = bytes.data() + i * sizeof(T);
    if (swap) std::reverse(at, at + sizeof(T));
    T value;
    std::memcpy(&value, at, sizeof value);
    out[i] = float(value);
  }
}

struct RawType {
  const char* name;
  std::size_t bytes;
  std::optional<double> maximum;
  Convert convert;
};

template <class T>
RawType rawType(const char* name) {
  std::optional<double> maximum;
  if (std::is_integral_v<T>) maximum = double(std::numeric_limits<T>::max());
  return {name, sizeof(T), maximum, convertAs<T>};
}

const RawType& findType(const std::string& name) {
  static const RawType kTypes[] = {rawType<std::uint8_t>("uint8"),   rawType<std::int8_t>("int8"),
                                   rawType<std::uint16_t>("uint16"), rawType<std::int16_t>("int16"),
                                   rawType<std::uint32_t>("uint32"), rawType<std::int32_t>("int32"),
                                   rawType<float>("float32"),        rawType<double>("float64")};
  std::string known;
  for (const RawType& type : kTypes) {
    if (name == type.name) return type;
    known += (known.empty() ? "" : ", ") + std::string(type.name);
  }
  throw UsageError("unknown type '" + name + "'; the types are " + known);
}

class RawImage : public ImageSource {
 public:
  RawImage(const fs::path& path, const RawLayout& layout)
      : path_(path), layout_(layout), type_(findType(layout.type)), file_(path, std::ios::binary) {
    checkSize();
    checkLength();
    if (!file_) throw BadInput("cannot read " + path_.string());
  }

  [[nodiscard]] Coord size() const override { return layout_.size; }
  [[nodiscard]] std::optional<double> typeMaximum() const override { return type_.maximum; }
  [[nodiscard]] std::array<double, 16> indexToWorld() const override {
    const double s = layout_.voxelSize;
    return {s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, 0, 0, 0, 1};
  }

  void read(const Slab& slab, std::span<float> out) override {
    bytes_.resize(out.size() * type_.bytes);
    const std::uint64_t before = std::uint64_t(slab.firstZ) * sliceBytes();
    file_.seekg(std::streamoff(layout_.headerBytes + before));
    file_.read(reinterpret_cast<char*>(bytes_.data()), std::streamsize(bytes_.size()));
    if (!file_)
      throw BadInput(path_.string() + ": cannot be read at slice " + std::to_string(slab.firstZ));
    type_.convert(bytes_, layout_.bigEndian, out);
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
    if (double(length) == expected) return;
    throw BadInput(
        path_.string() + " has " + std::to_string(length) + " bytes; " + toString(layout_.size) +
        " voxels of " + type_.name + " after " + std::to_string(layout_.headerBytes) +
        " bytes of header need " +
        (expected < 0x1p63 ? std::to_string(std::uint64_t(expected)) : "more than 2^63"));
  }

  fs::path path_;
  RawLayout layout_;
  const RawType& type_;
  std::ifstream file_;
  std::vector<std::byte> bytes_;
};

}  // namespace

std::unique_ptr<ImageSource> openRaw(const fs::path& path, const RawLayout& layout) {
  return std::make_unique<RawImage>(path, layout);
}

}  // namespace esvr::samples
