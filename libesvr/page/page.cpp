#include "page/page.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "capi/objects.h"
#include "esvr/camera.h"
#include "esvr/grid_coding.h"
#include "esvr/transfer_function.h"
#include "render/sample_rule.h"
#include "render/transfer_table.h"

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

}  // namespace
}  // namespace esvr::page

using namespace esvr;

char* page_grids(const esvr_file* file) {
  char* text = nullptr;
  (void)capi::guarded([&] { text = page::copyOf(page::gridsText(file->content)); });
  return text;
}

char* page_looks() {
  char* text = nullptr;
  (void)capi::guarded([&] { text = page::copyOf(page::looksText()); });
  return text;
}

esvr_status page_decode(const esvr_file* file, int grid, esvr_volume** volume) {
  return capi::guarded([&] {
    const StoredGrid& stored = file->content.grids.at(std::size_t(grid));
    const DecodeOptions options{.maxBytes = page::kMostMemory, .keepsNonFinite = false};
    *volume = new esvr_volume(decodeGrid(stored, options));
  });
}

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

page_tables* page_make_tables(const page_transfer* transfer, const page_sampling* sampling) {
  std::unique_ptr<page::Tables> tables;
  (void)capi::guarded(
      [&] { tables = std::make_unique<page::Tables>(page::functionOf(*transfer), *sampling); });
  return tables.release();
}

void page_free_tables(page_tables* tables) { delete static_cast<page::Tables*>(tables); }

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

esvr_status page_check_camera(const double* camera, int orthographic, int width, int height) {
  return capi::guarded([&] {
    Camera c{page::placeAt(camera), page::placeAt(camera + 3), page::placeAt(camera + 6),
             page::projectionOf(orthographic)};
    (orthographic != 0 ? c.height : c.fov) = camera[9];
    checkCamera(c, {width, height});
  });
}
