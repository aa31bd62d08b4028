#include "compare/external.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "cli/byte_size.h"
#include "cli/number.h"
#include "compare/grid_file.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

struct TypeWord {
  const char* word;
  std::size_t bytes;
};
constexpr std::array kTypes{TypeWord{"float32", 4}, TypeWord{"float64", 8}, TypeWord{"uint8", 1},
                            TypeWord{"uint16", 2}};

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw UsageError("--external '" + text + "': " + why +
                   "; the form is NAME=FILE:BYTES, with :NXxNYxNZ:TYPE if FILE is raw, and any "
                   "of :encode=S, :decode=S, :fps=N");
}

std::optional<Coord> parseDims(const std::string& text) {
  std::vector<std::int32_t> sides;
  for (const std::string& part : cli::splitText(text, 'x')) {
    const auto side = cli::parseWhole(part);
    if (!side || *side < 1 || *side > Box::kMax) return std::nullopt;
    sides.push_back(std::int32_t(*side));
  }
  if (sides.size() != 3) return std::nullopt;
  return Coord{sides[0], sides[1], sides[2]};
}

bool isType(const std::string& word) {
  for (const auto& type : kTypes)
    if (word == type.word) return true;
  return false;
}

/// Reads a part like "encode=4.2". \return false if it is not of this form
bool readFigure(const std::string& part, External& external) {
  const std::size_t equals = part.find('=');
  if (equals == std::string::npos) return false;
  const std::string key = part.substr(0, equals);
  const auto value = cli::parseNumber(part.substr(equals + 1));
  if (!value || *value < 0.0) return false;
  if (key == "encode")
    external.encodeSeconds = value;
  else if (key == "decode")
    external.decodeSeconds = value;
  else if (key == "fps")
    external.fps = value;
  else
    return false;
  return true;
}

void readPart(const std::string& part, External& external) {
  if (readFigure(part, external)) return;
  if (const auto dims = parseDims(part))
    external.dims = dims;
  else if (isType(part))
    external.type = part;
  else
    refuse(external.text, "'" + part + "' is not understood");
}

std::size_t bytesOf(const std::string& type) {
  for (const auto& known : kTypes)
    if (type == known.word) return known.bytes;
  return 0;
}

template <class T>
float valueAt(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return float(value);
}

float valueOf(const std::string& type, const std::byte* from) {
  static_assert(std::endian::native == std::endian::little);
  if (type == "float64") return valueAt<double>(from);
  if (type == "uint8") return valueAt<std::uint8_t>(from);
  if (type == "uint16") return valueAt<std::uint16_t>(from);
  return valueAt<float>(from);
}

/// Checks the size of a raw file.
void checkRaw(const External& external, const Box& box) {
  const std::string file = external.file.string() + ": ";
  const Coord side = box.max - box.min + Coord{1, 1, 1};
  if (*external.dims != side)
    throw BadInput(file + toString(*external.dims) + " voxels, but the box that is compared has " +
                   toString(side));
  std::error_code error;
  const auto size = std::filesystem::file_size(external.file, error);
  if (error) throw BadInput(file + error.message());
  const double wanted = box.volume() * double(bytesOf(external.type));
  if (double(size) != wanted)
    throw BadInput(file + std::to_string(size) + " bytes, but " + toString(side) + " voxels of " +
                   external.type + " take " + std::to_string(std::uint64_t(wanted)));
}

/// Reads a raw file slice by slice (z is slowest) into bricks.
class RawReader {
 public:
  RawReader(const External& external, const ExternalPlace& place)
      : external_(external), place_(place), stream_(external.file, std::ios::binary) {}

  SparseVolume read() {
    const Box& box = place_.box;
    std::vector<BrickInput> bricks;
    for (int z = brickOf(box.min).z; z <= brickOf(box.max).z; ++z) appendLayer(z, bricks);
    return makeVolume(std::move(bricks), place_.background);
  }

 private:
  /// Appends the bricks of one layer along z.
  void appendLayer(int brickZ, std::vector<BrickInput>& bricks) {
    const Coord first = brickOf(place_.box.min), last = brickOf(place_.box.max);
    const auto [nx, ny] = std::array{last.x - first.x + 1, last.y - first.y + 1};
    BrickInput empty{};
    empty.values.fill(place_.background);
    std::vector<BrickInput> layer(std::size_t(nx) * std::size_t(ny), empty);
    for (int x = 0; x < nx; ++x)
      for (int y = 0; y < ny; ++y)
        layer[std::size_t(x) * ny + y].corner =
            Coord{first.x + x, first.y + y, brickZ} * kBrickSide;
    const int begin = std::max(brickZ * kBrickSide, place_.box.min.z);
    const int end = std::min(brickZ * kBrickSide + kBrickSide - 1, place_.box.max.z);
    for (int z = begin; z <= end; ++z) readSlice(z, ny, layer);
    for (const auto& brick : layer)
      if (brick.active.count() > 0) bricks.push_back(brick);
  }

  void readSlice(int z, int ny, std::vector<BrickInput>& layer) {
    const Box& box = place_.box;
    const std::size_t bytes = bytesOf(external_.type);
    row_.resize(std::size_t(box.max.x - box.min.x + 1) * bytes);
    for (int y = box.min.y; y <= box.max.y; ++y) {
      stream_.read(reinterpret_cast<char*>(row_.data()), std::streamsize(row_.size()));
      if (!stream_) throw BadInput(external_.file.string() + ": cannot be read");
      for (int x = box.min.x; x <= box.max.x; ++x)
        set({x, y, z}, valueOf(external_.type, &row_[std::size_t(x - box.min.x) * bytes]), ny,
            layer);
    }
  }

  void set(Coord voxel, float value, int ny, std::vector<BrickInput>& layer) const {
    if (!std::isfinite(value))
      throw BadInput(external_.file.string() + ": the value at " + toString(voxel) +
                     " is not finite");
    const Coord brick = brickOf(voxel) - brickOf(place_.box.min);
    BrickInput& to = layer[std::size_t(brick.x) * ny + brick.y];
    const int offset = voxelOffset(localOf(voxel));
    to.values[offset] = value;
    if (value != place_.background) to.active.set(offset);
  }

  const External& external_;
  const ExternalPlace& place_;
  std::ifstream stream_;
  std::vector<std::byte> row_;
};

SparseVolume readVdb(const External& external, const ExternalPlace& place) {
  const GridFile file(external.file, place.memory);
  return file.read(file.grids().size() == 1 ? 0 : file.find(place.grid)).volume;
}

}  // namespace

External parseExternal(const std::string& text) {
  External external;
  external.text = text;
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) refuse(text, "it has no name");
  external.name = text.substr(0, equals);
  const auto parts = cli::splitText(text.substr(equals + 1), ':');
  if (parts.size() < 2 || parts[0].empty()) refuse(text, "it has no file and bytes");
  external.file = parts[0];
  external.bytes = cli::parseByteSize("external", parts[1]);
  for (std::size_t i = 2; i < parts.size(); ++i) readPart(parts[i], external);
  if (external.dims.has_value() == external.type.empty())
    refuse(text, "dimensions and a type come together");
  return external;
}

SparseVolume readExternal(const External& external, const ExternalPlace& place) {
  if (!external.dims) return readVdb(external, place);
  checkRaw(external, place.box);
  return RawReader(external, place).read();
}

}  // namespace esvr::compare
