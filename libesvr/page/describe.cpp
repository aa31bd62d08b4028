#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>

#include "capi/objects.h"
#include "esvr/transfer_function.h"
#include "page/page.h"

namespace esvr::page {
namespace {

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

/// The look that esvr-render gives a grid without options (render/render_options.cpp).
TransferFunction usualLook(const StoredGrid& grid) {
  const float background = float(grid.descriptor.background);
  if (grid.descriptor.gridClass == GridClass::kLevelSet && background > 0.0f)
    return levelSetSurface(double(background));
  const ValueRange range{std::min(grid.valueMin, background), std::max(grid.valueMax, background)};
  return rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, range);
}

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
  json.name("range").list(std::initializer_list<double>{grid.valueMin, grid.valueMax});
  json.name("histogram").raw("null");
  putLook(json.name("defaultLook"), usualLook(grid));
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
