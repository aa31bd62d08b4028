// What the exported page needs beside the C interface of the decoder (esvr/esvr.h): a description
// of a file, voxels in the form of textures, the tables of a transfer function, and cameras. All of
// it is the library's own code, so that the page draws what esvr-render draws.
//
// The functions are called from JavaScript (src/local/decoder.js), which reads the structs. All their
// members have four bytes there, pointers too. The caller frees texts by free().

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capi/objects.h"
#include "esvr/camera.h"
#include "esvr/esvr.h"
#include "esvr/grid_coding.h"
#include "esvr/transfer_function.h"
#include "render/cell_bricks.h"
#include "render/sample_rule.h"
#include "render/transfer_table.h"

extern "C" {

/// The bricks of a volume that rays march through, as two textures.
///
/// Bricks have 8 x 8 x 8 cells and store the 9 x 9 x 9 voxels at their corners, as in the library
/// (render/brick_march.h). The atlas has room for slots[0] x slots[1] x slots[2] of them, x fastest;
/// a voxel is (value - background) / scale. The table has four bytes for each brick
/// of the box, x fastest: the place of its slot along x, y and z and 0, or 0, 0, 0 and the distance
/// in bricks, at least 1, within which all bricks are empty (the distance 1 is the brick itself).
struct page_atlas {
  int level;      ///< voxels are means of 2^level x 2^level x 2^level voxels
  int origin[3];  ///< first voxel of the table's first brick, in voxels of the level
  int bricks[3];  ///< size of the table
  int slots[3];   ///< size of the atlas
  int count;      ///< number of slots that are used
  float background;
  float scale;
  float least, most;  ///< smallest and largest stored voxel
  const unsigned char* table;
  const float* voxels;
};

/// A transfer function as points in rows of four numbers, as in the viewer's protocol.
struct page_transfer {
  int space;  ///< place in RGB, HSV, HSVWrap, Lab, Diverging, Step
  int color_count, opacity_count;
  const double* colors;   ///< value, red, green, blue
  const double* opacity;  ///< value, opacity, midpoint, sharpness
};

/// The tables of the library's renderers (render/transfer_table.h). Places count
/// intervals from the lowest value of the transfer function.
struct page_tables {
  int intervals;
  float low, scale;             ///< lowest value and intervals per unit; scale 0: no extent
  float weak_gradient_squared;  ///< the square of the gradient at which half of the shading is left
  float least_bend;             ///< intervals; SegmentTableView::leastBend
  const float* values;          ///< intervals + 1 times red, green, blue, alpha
  /// side x side times the light of a segment as red, green, blue and alpha, premultiplied. Entry
  /// (i, j), i fastest, is a segment from the value i to the value j of `side` values at equal distances
  /// from the first to the last. Null if no segments are wanted.
  const float* segments;
  float below[4], above[4];  ///< colors and extinctions beyond the ends; alpha is the extinction
};

/// What the tables are made for.
struct page_sampling {
  double length;       ///< length of a step in units of the length that opacities are given for
  double first, last;  ///< range of values of the table of segments
  int side;            ///< of the table of segments; 0: none is wanted
};
}

namespace esvr::page {
namespace {

// Descriptions as JSON

/// Writes JSON. Numbers are float64 texts that give the same number again.
class Json {
 public:
  [[nodiscard]] const std::string& text() const { return text_; }

  Json& raw(const char* text) {
    text_ += text;
    return *this;
  }
  Json& number(double value) {
    constexpr int kLongest = 32;
    char digits[kLongest];
    std::snprintf(digits, sizeof digits, "%.17g", value);
    return raw(std::isfinite(value) ? digits : "null");
  }
  Json& string(const std::string& value) {
    text_ += '"';
    for (const char c : value) put(c);
    text_ += '"';
    return *this;
  }
  Json& name(const char* name) { return next().string(name).raw(":"); }
  /// A comma, unless it would be the first in its list.
  Json& next() {
    const char last = text_.empty() ? '[' : text_.back();
    return last == '[' || last == '{' || last == ':' ? *this : raw(",");
  }
  template <class Numbers>
  Json& list(const Numbers& numbers) {
    raw("[");
    for (const double value : numbers) next().number(value);
    return raw("]");
  }

 private:
  void put(char c) {
    constexpr unsigned char kFirstPlain = 0x20;
    char code[8];
    if (c == '"' || c == '\\') text_ += '\\';
    if (static_cast<unsigned char>(c) >= kFirstPlain) {
      text_ += c;
    } else {
      std::snprintf(code, sizeof code, "\\u%04x", unsigned(c));
      text_ += code;
    }
  }

  std::string text_;
};

constexpr const char* kSpaces[] = {"RGB", "HSV", "HSVWrap", "Lab", "Diverging", "Step"};
constexpr const char* kClasses[] = {"unknown", "level set", "fog volume", "staggered"};

void putPoints(Json& json, const ColorMap& map) {
  json.raw("[");
  for (const ColorPoint& p : map.points)
    json.next().list(std::initializer_list<double>{p.x, p.color.r, p.color.g, p.color.b});
  json.raw("]");
}
void putPoints(Json& json, const OpacityCurve& curve) {
  json.raw("[");
  for (const OpacityPoint& p : curve)
    json.next().list(std::initializer_list<double>{p.x, p.opacity, p.midpoint, p.sharpness});
  json.raw("]");
}

/// The memory that decoding may take: that of the module (CMakeLists.txt), whose sizes have 32 bits.
constexpr std::uint64_t kMostMemory = std::uint64_t{1} << 31;

/// The look that esvr-render gives a grid without options.
TransferFunction lookOf(const StoredGrid& grid) { return usualLook(lookBasis(grid, kMostMemory)); }

void putLook(Json& json, const TransferFunction& f) {
  json.raw("{").name("space").string(kSpaces[int(f.colors.space)]);
  putPoints(json.name("colors"), f.colors);
  putPoints(json.name("opacity"), f.opacity);
  json.name("range").list(std::initializer_list<double>{f.opacity.front().x, f.opacity.back().x});
  json.raw("}");
}

/// The text of the metadata "unit" or "units".
std::string unitOf(const GridDescriptor& grid) {
  for (const char* name : {"unit", "units"})
    for (const MetaItem& item : grid.metadata)
      if (item.name == name && item.type == "string" && !item.value.empty())
        return {reinterpret_cast<const char*>(item.value.data()), item.value.size()};
  return {};
}

/// Lengths of the grid's axes in the world; null for a frustum.
void putVoxelSize(Json& json, const Transform& transform) {
  if (!transform.affine) return void(json.raw("null"));
  const auto& m = *transform.affine;
  json.raw("[");
  for (std::size_t row = 0; row < 12; row += 4)
    json.next().number(std::hypot(m[row], m[row + 1], m[row + 2]));
  json.raw("]");
}

/// The edges of a voxel in a camera's space (esvr/camera.h); null for a frustum.
void putEdges(Json& json, const Transform& transform) {
  const auto shape = voxelShape(transform.affine);
  if (!shape) return void(json.raw("null"));
  json.raw("[");
  for (const Vec3& edge : shape->edges) json.next().list(edge);
  json.raw("]");
}

void putBox(Json& json, const Box& box) {
  json.raw("[");
  for (const Coord corner : {box.min, box.max})
    json.next().list(
        std::initializer_list<double>{double(corner.x), double(corner.y), double(corner.z)});
  json.raw("]");
}

void putGrid(Json& json, const StoredGrid& grid) {
  const bool voxels = grid.voxels.has_value();
  json.next().raw("{").name("name").string(grid.descriptor.name);
  json.name("kind").string(voxels ? "voxels" : "ellipsoids");
  json.name("class").string(kClasses[int(grid.descriptor.gridClass)]);
  json.name("unit").string(unitOf(grid.descriptor));
  json.name("ellipsoids").number(double(grid.field.ellipsoidCount()));
  json.name("activeVoxels").number(double(grid.activeVoxels));
  json.name("background").number(float(grid.descriptor.background));
  putBox(json.name("box"), grid.activeBox);
  putVoxelSize(json.name("voxelSize"), grid.descriptor.transform);
  putEdges(json.name("edges"), grid.descriptor.transform);
  json.name("range").list(std::initializer_list<double>{grid.valueMin, grid.valueMax});
  json.name("histogram").raw("null");
  putLook(json.name("defaultLook"), lookOf(grid));
  json.raw("}");
}

std::string gridsText(const EsvrFile& file) {
  Json json;
  json.raw("[");
  for (const StoredGrid& grid : file.grids) putGrid(json, grid);
  return json.raw("]").text();
}

std::string looksText() {
  Json json;
  json.raw("{").name("colormaps").raw("{");
  for (const std::string& name : builtInColorMaps()) {
    const ColorMap map = builtInColorMap(name);
    json.name(name.c_str()).raw("{").name("space").string(kSpaces[int(map.space)]);
    putPoints(json.name("points"), map);
    json.raw("}");
  }
  json.raw("}").name("opacities").raw("{");
  for (const std::string& name : builtInOpacities())
    putPoints(json.name(name.c_str()), builtInOpacity(name));
  return json.raw("}}").text();
}

/// A copy that the caller frees; null if there is no memory.
char* copyOf(const std::string& text) { return strdup(text.c_str()); }

// The tables of a transfer function

TransferFunction functionOf(const page_transfer& t) {
  TransferFunction f;
  f.colors.space = ColorSpace(t.space);
  for (const double* p = t.colors; p != t.colors + 4 * t.color_count; p += 4)
    f.colors.points.push_back({p[0], {p[1], p[2], p[3]}});
  for (const double* p = t.opacity; p != t.opacity + 4 * t.opacity_count; p += 4)
    f.opacity.push_back({p[0], p[1], p[2], p[3]});
  checkTransferFunction(f);
  return f;
}

/// Tables, and what their pointers point to.
struct Tables : page_tables {
  Tables(const TransferFunction& f, const page_sampling& sampling)
      : page_tables{}, table(f, Sampling{sampling.length, sampling.side > 1}) {
    const TransferTableView view = table.view();
    intervals = TransferTableView::kIntervals;
    low = view.low, scale = view.scale;
    weak_gradient_squared = lightRule({}, View({}, {}), f).weakSquared;  // the same for every view
    least_bend = view.segments.leastBend;
    static_assert(sizeof(Classified) == 4 * sizeof(float));
    values = &view.entries->r;
    if (sampling.side > 1) fillSegments(view.segments, sampling);
  }
  TransferTable table;
  std::vector<PixelColor> lights{};

 private:
  void fillSegments(const SegmentTableView& view, const page_sampling& sampling) {
    const double apart = (sampling.last - sampling.first) / (sampling.side - 1);
    const auto valueAt = [&](int i) { return float(sampling.first + i * apart); };
    lights.reserve(std::size_t(sampling.side) * std::size_t(sampling.side));
    for (int j = 0; j < sampling.side; ++j)
      for (int i = 0; i < sampling.side; ++i) lights.push_back(view(valueAt(i), valueAt(j)));
    static_assert(sizeof(PixelColor) == 4 * sizeof(float));
    segments = &lights.front().r;
    std::copy_n(view.entries[0].mean.c, 4, below);
    std::copy_n(view.entries[intervals + 1].mean.c, 4, above);
  }
};

// Cameras

Projection projectionOf(int orthographic) {
  return orthographic != 0 ? Projection::kOrthographic : Projection::kPerspective;
}

Vec3 placeAt(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

// The textures of a volume

constexpr int kMostSlots = 255;     ///< places along an axis that a byte of the table can hold
constexpr int kTableBytes = 4;      ///< bytes of a brick's entry in the table
constexpr int kCoarsestLevel = 16;  ///< every volume is a single brick long before

/// The size of an atlas that is about a cube and has room for `count` slots; nothing if it would be
/// too large.
std::optional<Coord> slotsFor(std::size_t count, int mostSide) {
  const int most = std::min(kMostSlots, mostSide / kCellBrickSide);
  const auto ceilOf = [](double a) { return std::max(1, int(std::ceil(a))); };
  const int x = std::min(most, ceilOf(std::cbrt(double(count))));
  const int y = std::min(most, ceilOf(std::sqrt(double(count) / x)));
  const int z = ceilOf(double(count) / x / y);
  return z <= most ? std::optional(Coord{x, y, z}) : std::nullopt;
}

/// Distances, in bricks along the axis that is farthest, to the nearest brick that is not empty.
class Distances {
 public:
  Distances(Coord size, const std::vector<Coord>& occupied)
      : size_(size), of_(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z), kFar) {
    for (const Coord brick : occupied) of_[at(brick)] = 0;
    // The largest of three distances along axes: one pass for each axis and direction suffices,
    // because a step along an axis may be combined with steps along the axes before it.
    for (int axis = 0; axis < 3; ++axis) spread(axis);
  }
  [[nodiscard]] std::size_t at(Coord b) const {
    return (std::size_t(b.z) * std::size_t(size_.y) + std::size_t(b.y)) * std::size_t(size_.x) +
           std::size_t(b.x);
  }
  [[nodiscard]] const std::vector<std::uint8_t>& all() const { return of_; }

 private:
  static constexpr std::uint8_t kFar = 255;

  /// Chebyshev distance is separable: d(x) = min over x' of max(|x - x'|, d(x')).
  void spread(int axis) {
    const std::size_t step = axis == 0   ? 1
                             : axis == 1 ? std::size_t(size_.x)
                                         : std::size_t(size_.x) * std::size_t(size_.y);
    const int length = axis == 0 ? size_.x : (axis == 1 ? size_.y : size_.z);
    for (std::size_t first = 0; first < of_.size(); ++first)
      if (first / step % std::size_t(length) == 0) spreadLine(&of_[first], step, length);
  }
  void spreadLine(std::uint8_t* line, std::size_t step, int length) {
    line_.resize(std::size_t(length));
    for (int i = 0; i < length; ++i) line_[std::size_t(i)] = line[std::size_t(i) * step];
    for (int i = 0; i < length; ++i) line[std::size_t(i) * step] = nearest(i, length);
  }
  [[nodiscard]] std::uint8_t nearest(int i, int length) const {
    int best = line_[std::size_t(i)];
    for (int r = 1; r < best; ++r) {
      const int below = i >= r ? line_[std::size_t(i - r)] : kFar;
      const int above = i + r < length ? line_[std::size_t(i + r)] : kFar;
      best = std::min(best, std::max(r, std::min(below, above)));
    }
    return std::uint8_t(best);
  }

  Coord size_;
  std::vector<std::uint8_t> of_;
  std::vector<std::uint8_t> line_;
};

/// An atlas with the memory of its textures.
struct Atlas : page_atlas {
  std::vector<std::uint8_t> bytes;
  std::vector<float> shares;
};

void set(int (&to)[3], Coord c) { to[0] = c.x, to[1] = c.y, to[2] = c.z; }

/// The largest difference from the background, or 1 if there is none.
float scaleOf(const BrickAtlas& from, float background) {
  float largest = 0.0f;
  for (const float v : from.values) largest = std::max(largest, std::fabs(v - background));
  return largest > 0.0f ? largest : 1.0f;
}

class AtlasMaker {
 public:
  AtlasMaker(const BrickAtlas& from, const Box& box, Coord slots) : from_(from), box_(box) {
    set(atlas_->slots, slots);
  }

  std::unique_ptr<Atlas> make(float background, int level) {
    Atlas& a = *atlas_;
    a.level = level;
    set(a.origin, box_.min * kBrickSide);
    set(a.bricks, box_.max - box_.min + Coord{1, 1, 1});
    a.count = int(from_.table.bricks.size());
    a.background = background;
    a.scale = scaleOf(from_, background);
    fillTable();
    fillVoxels();
    const auto [least, most] = std::minmax_element(a.shares.begin(), a.shares.end());
    a.least = *least, a.most = *most;
    a.table = a.bytes.data(), a.voxels = a.shares.data();
    return std::move(atlas_);
  }

 private:
  [[nodiscard]] Coord brickAt(std::size_t i) const { return from_.table.place(i) - box_.min; }
  [[nodiscard]] Coord slotOf(std::size_t i) const {
    const int n = int(i), x = atlas_->slots[0], y = atlas_->slots[1];
    return {n % x, n / x % y, n / x / y};
  }

  void fillTable() {
    std::vector<Coord> bricks;
    for (std::size_t i = 0; i < from_.table.bricks.size(); ++i) bricks.push_back(brickAt(i));
    const int(&size)[3] = atlas_->bricks;
    const Distances distances({size[0], size[1], size[2]}, bricks);
    auto& bytes = atlas_->bytes;
    bytes.resize(distances.all().size() * kTableBytes);
    for (std::size_t b = 0; b < distances.all().size(); ++b)
      bytes[b * kTableBytes + 3] = distances.all()[b];
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      std::uint8_t* const entry = &bytes[distances.at(bricks[i]) * kTableBytes];
      const Coord slot = slotOf(i);
      entry[0] = std::uint8_t(slot.x), entry[1] = std::uint8_t(slot.y);
      entry[2] = std::uint8_t(slot.z);
    }
  }

  void fillVoxels() {
    const int(&slots)[3] = atlas_->slots;
    width_ = std::size_t(slots[0] * kCellBrickSide),
    height_ = std::size_t(slots[1] * kCellBrickSide);
    atlas_->shares.assign(width_ * height_ * std::size_t(slots[2] * kCellBrickSide), 0);
    for (std::size_t i = 0; i < from_.table.bricks.size(); ++i)
      fillSlot(&from_.values[i * kCellBrickVoxels], slotOf(i) * kCellBrickSide);
  }
  /// \param from  voxels of a brick, z fastest
  void fillSlot(const float* from, Coord first) {
    const float perScale = 1.0f / atlas_->scale;
    for (int x = 0; x < kCellBrickSide; ++x)
      for (int y = 0; y < kCellBrickSide; ++y)
        for (int z = 0; z < kCellBrickSide; ++z) {
          const Coord to = first + Coord{x, y, z};
          const float share = (*from++ - atlas_->background) * perScale;
          atlas_->shares[(std::size_t(to.z) * height_ + std::size_t(to.y)) * width_ +
                         std::size_t(to.x)] = share;
        }
  }

  const BrickAtlas& from_;
  Box box_;
  std::size_t width_ = 0, height_ = 0;
  std::unique_ptr<Atlas> atlas_ = std::make_unique<Atlas>();
};

Box boxOf(const BrickAtlas& atlas) {
  Box box;
  for (std::size_t i = 0; i < atlas.table.bricks.size(); ++i) box.expand(atlas.table.place(i));
  if (box.empty()) box.expand(Coord{});
  return box;
}

/// An atlas of a volume; null if its textures would be too large.
std::unique_ptr<Atlas> atlasOf(const SparseVolume& volume, int level, int mostSide,
                               double mostBytes) {
  // The bricks of voxels tell early that an atlas would be too large. An atlas has more bricks.
  const double perBrick = kCellBrickVoxels * sizeof(float);
  if (double(volume.brickCount()) * perBrick > mostBytes) return nullptr;
  const BrickAtlas bricks = makeBrickAtlas(volume);
  const Box box = boxOf(bricks);
  const auto slots = slotsFor(bricks.table.bricks.size(), mostSide);
  const Coord size = box.max - box.min + Coord{1, 1, 1};
  if (!slots || std::max({size.x, size.y, size.z}) > mostSide) return nullptr;
  const double slotCount = double(slots->x) * slots->y * slots->z;
  if (slotCount * perBrick + box.volume() * kTableBytes > mostBytes) return nullptr;
  return AtlasMaker(bricks, box, *slots).make(volume.background, level);
}

std::unique_ptr<Atlas> makeAtlas(const SparseVolume& volume, int level, int mostSide,
                                 double mostBytes) {
  VolumeLevels levels(volume);
  for (; level <= kCoarsestLevel; ++level) {
    levels.prepare(level);
    if (auto atlas = atlasOf(levels[level], level, mostSide, mostBytes)) return atlas;
  }
  throw MemoryExceeded("the volume is too large for this page");
}

}  // namespace
}  // namespace esvr::page

using namespace esvr;

extern "C" {

/// A JSON text: the member "grids" of a file in the viewer's protocol, with a usual look.
/// \return null on failure (esvr_error)
char* page_grids(const esvr_file* file) {
  char* text = nullptr;
  (void)capi::guarded([&] { text = page::copyOf(page::gridsText(file->content)); });
  return text;
}

/// A JSON text: the members "colormaps" and "opacities" of the viewer's description.
/// \return null on failure
char* page_looks() {
  char* text = nullptr;
  (void)capi::guarded([&] { text = page::copyOf(page::looksText()); });
  return text;
}

/// Decodes a grid as drawing takes it: voxels that are NaN or infinite are empty. Everything below that takes a volume
/// takes one of these, whose values are all finite.
/// \param volume  output; freed by esvr_free_volume
esvr_status page_decode(const esvr_file* file, int grid, esvr_volume** volume) {
  return capi::guarded([&] {
    const StoredGrid& stored = file->content.grids.at(std::size_t(grid));
    const DecodeOptions options{.maxBytes = page::kMostMemory, .keepsNonFinite = false};
    *volume = new esvr_volume(decodeGrid(stored, options));
  });
}

/// Counts the active voxels of a volume in `count` intervals from `low` to `high`. Values outside
/// count in the first or the last one.
void page_histogram(const esvr_volume* volume, double low, double high, int count, double* counts) {
  std::fill_n(counts, count, 0.0);
  const double perUnit = high > low ? count / (high - low) : 0.0;
  const SparseVolume& voxels = volume->voxels;
  for (std::size_t b = 0; b < voxels.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!voxels.active[b].test(v)) continue;
      const double place = (double(voxels.brickValues(b)[std::size_t(v)]) - low) * perUnit;
      ++counts[int(std::clamp(place, 0.0, double(count - 1)))];
    }
}

/// \param level      coarser level of detail to begin with
/// \param most_side  largest side of a 3D texture, in voxels
/// \param most_bytes largest size of both textures together; a coarser level is taken if it is
///                   exceeded
/// \return null on failure
page_atlas* page_make_atlas(const esvr_volume* volume, int level, int most_side,
                            double most_bytes) {
  std::unique_ptr<page::Atlas> atlas;
  (void)capi::guarded(
      [&] { atlas = page::makeAtlas(volume->voxels, level, most_side, most_bytes); });
  return atlas.release();
}

void page_free_atlas(page_atlas* atlas) { delete static_cast<page::Atlas*>(atlas); }

/// \return null on failure
page_tables* page_make_tables(const page_transfer* transfer, const page_sampling* sampling) {
  std::unique_ptr<page::Tables> tables;
  (void)capi::guarded(
      [&] { tables = std::make_unique<page::Tables>(page::functionOf(*transfer), *sampling); });
  return tables.release();
}

void page_free_tables(page_tables* tables) { delete static_cast<page::Tables*>(tables); }

/// Fits a camera to a box of voxels.
/// \param box        x0, y0, z0, x1, y1, z1
/// \param edges      of a voxel in the camera's space, three places; null: a cube
/// \param direction  from the middle to the eye; null: the usual view
/// \param camera     output: eye, center, up, and the field of view or the height
void page_fit(const int* box, const double* edges, const double* direction, int orthographic,
              int width, int height, double* camera) {
  CameraWish wish;
  if (edges != nullptr)
    for (int a = 0; a < 3; ++a) wish.voxel.edges[a] = page::placeAt(edges + 3 * a);
  wish.projection = page::projectionOf(orthographic);
  if (direction != nullptr) wish.direction = page::placeAt(direction);
  const Box voxels{{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
  const Camera fitted = fitCamera(voxels, wish, {width, height});
  for (const Vec3& place : {fitted.eye, fitted.center, fitted.up})
    camera = std::copy(place.begin(), place.end(), camera);
  *camera = orthographic != 0 ? fitted.height : fitted.fov;
}

/// Checks a camera: eye, center, up, and the field of view or the height.
esvr_status page_check_camera(const double* camera, int orthographic, int width, int height) {
  return capi::guarded([&] {
    Camera c{page::placeAt(camera), page::placeAt(camera + 3), page::placeAt(camera + 6),
             page::projectionOf(orthographic)};
    (orthographic != 0 ? c.height : c.fov) = camera[9];
    checkCamera(c, {width, height});
  });
}
}
