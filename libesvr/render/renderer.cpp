// Makes renderers, which keep voxels from picture to picture, for the CPU or a CUDA device, and draws pictures in passes.
#include "esvr/render.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "esvr/error.h"
#include "render/cuda/cuda_renderers.h"
#include "render/ellipsoid_view.h"
#include "render/picture.h"
#include "render/render_cells.h"

namespace esvr {
namespace {

/// A renderer on the CPU.
/// \tparam Draw  draw(options) returns a picture; draw.forget() is optional
template <class Draw>
class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(Draw draw) : draw_(std::move(draw)) {}

  Image draw(const RenderOptions& options) override {
    const auto begin = std::chrono::steady_clock::now();
    Image image = draw_(options);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    stats_.drawMs = took.count();
    return image;
  }
  void drawOnDevice(const RenderOptions& options) override { (void)draw(options); }
  void forget() override {
    if constexpr (requires { draw_.forget(); }) draw_.forget();
  }
  FrameStats stats() const override { return stats_; }

 private:
  Draw draw_;
  FrameStats stats_;
};

/// Draws a field on the CPU. Its voxels are kept from picture to picture. Voxels that lie far apart
/// are decoded at once, and their bricks are found by a search.
struct FieldDrawing {
  Image operator()(const RenderOptions& options) {
    if (options.between == Between::kSum) return renderField(field, options, voxels);
    if (!cells && !levels) prepare();
    return levels ? renderLevels(*levels, options) : renderCells(*cells, options);
  }
  void forget() {
    if (cells) cells->forget();
  }
  void prepare() {
    if (!liesFarApart(field, voxels.box)) {
      cells = std::make_unique<LazyCells>(field, voxels);
      return;
    }
    decoded = std::make_unique<SparseVolume>(revoxelise(field, voxels));
    levels = std::make_unique<VolumeLevels>(*decoded);
  }

  const Field& field;
  const RevoxeliseOptions voxels;
  std::unique_ptr<LazyCells> cells{};
  std::unique_ptr<SparseVolume> decoded{};
  std::unique_ptr<VolumeLevels> levels{};  ///< of `decoded`
};

/// Draws a volume on the CPU. Its levels of detail are kept from picture to picture.
struct VolumeDrawing {
  Image operator()(const RenderOptions& options) { return renderLevels(levels, options); }

  VolumeLevels levels;
};

/// Draws several grids on the CPU. Their voxels are kept from picture to picture.
struct GridsDrawing {
  Image operator()(const RenderOptions& options) { return renderGrids(grids, options); }
  void forget() {
    for (GridCells& grid : grids) grid.forget();
  }

  std::vector<GridCells> grids;
};

template <class Draw>
std::unique_ptr<Renderer> makeCpuRenderer(Draw draw) {
  return std::make_unique<CpuRenderer<Draw>>(std::move(draw));
}

/// Draws a field on a CUDA device with one renderer for each rule between voxels. A renderer is
/// made when it is needed, because each keeps data of its own on the device. Voxels that lie far apart
/// are decoded at once, and drawn from a NanoVDB grid, which needs no table of the space between them.
class CudaFieldRenderers final : public Renderer {
 public:
  CudaFieldRenderers(const Field& field, const Device& device, const RendererLimits& limits,
                     const RevoxeliseOptions& voxels)
      : field_(field), device_(device), limits_(limits), voxels_(voxels) {
    (void)of(isFarApart_ ? Between::kSum : Between::kVoxels);
  }

  Image draw(const RenderOptions& options) override { return checked(options).draw(options); }
  void drawOnDevice(const RenderOptions& options) override {
    checked(options).drawOnDevice(options);
  }
  void forget() override {
    if (voxelsDrawn_) voxelsDrawn_->forget();
  }
  FrameStats stats() const override { return last_->stats(); }

 private:
  Renderer& checked(const RenderOptions& options) {
    if (options.shading && isFarApart_ && options.between == Between::kVoxels)
      throw UsageError(
          "ellipsoids that lie so far apart cannot be shaded on a GPU; draw them on the CPU");
    return of(options.between);
  }
  Renderer& of(Between between) {
    auto& renderer = between == Between::kSum ? sums_ : voxelsDrawn_;
    if (!renderer)
      renderer = between == Between::kSum
                     ? cuda::makeCudaSumRenderer(field_, device_, limits_, voxels_)
                     : makeVoxels();
    last_ = renderer.get();
    return *renderer;
  }
  [[nodiscard]] std::unique_ptr<Renderer> makeVoxels() const {
    if (!isFarApart_) return cuda::makeCudaCellRenderer(field_, device_, limits_, voxels_);
    VolumeGrid decoded;
    decoded.descriptor.transform = uniformTransform(1.0);  // pictures are drawn in the index space
    decoded.volume = revoxelise(field_, voxels_);
    return cuda::makeCudaNanoRenderer(makeNanoVolume(decoded, NanoValues::kFloat), device_,
                                      limits_);
  }

  const Field& field_;
  const Device device_;
  const RendererLimits limits_;
  const RevoxeliseOptions voxels_;
  const bool isFarApart_ = liesFarApart(field_, voxels_.box);
  std::unique_ptr<Renderer> sums_, voxelsDrawn_;
  Renderer* last_ = nullptr;
};

}  // namespace

bool liesFarApart(const Field& field, const Box& wanted) {
  constexpr double kMostBlocks = double(1 << 26);  // 256 MB
  const auto box = supportBox(field);
  if (!box) return false;
  const Vec3 low = pointOf(wanted.min), high = pointOf(wanted.max);
  double blocks = 1.0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double side = std::min(box->high[a], high[a]) - std::max(box->low[a], low[a]);
    blocks *= std::max(0.0, side) / kBlockSide + 2.0;
  }
  return blocks > kMostBlocks;
}

std::unique_ptr<Renderer> makeFieldRenderer(const Field& field, const Device& device,
                                            const RendererLimits& limits,
                                            const RevoxeliseOptions& voxels) {
  if (limits.depthParts < 0 || limits.depthParts > RendererLimits::kMaxDepthParts)
    throw UsageError("parts of the depth must be from 1 to " +
                     std::to_string(RendererLimits::kMaxDepthParts) + ", or 0 to have them chosen");
  if (device.kind == DeviceKind::kCuda)
    return std::make_unique<CudaFieldRenderers>(field, device, limits, voxels);
  return makeCpuRenderer(FieldDrawing{field, voxels});
}

std::unique_ptr<Renderer> makeVolumeRenderer(const SparseVolume& volume, const Device& device,
                                             const RendererLimits& limits) {
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaVolumeRenderer(volume, device, limits);
  return makeCpuRenderer(VolumeDrawing{VolumeLevels(volume)});
}

std::unique_ptr<Renderer> makeGridsRenderer(const std::vector<DrawnGrid>& grids,
                                            const Device& device, const RendererLimits& limits) {
  if (grids.empty() || grids.size() > std::size_t(kMostGrids))
    throw UsageError("a picture can show 1 to " + std::to_string(kMostGrids) + " grids, not " +
                     std::to_string(grids.size()));
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaGridsRenderer(grids, device, limits);
  return makeCpuRenderer(GridsDrawing{{grids.begin(), grids.end()}});
}

std::unique_ptr<Renderer> makeNanoRenderer(const NanoVolume& volume, const Device& device,
                                           const RendererLimits& limits) {
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaNanoRenderer(volume, device, limits);
  return makeCpuRenderer([&volume](const RenderOptions& o) { return renderNano(volume, o); });
}

// ---- Pictures in passes from coarse to fine

namespace {

Resolution coarser(Resolution r, int side) {
  return {(r.width + side - 1) / side, (r.height + side - 1) / side};
}

/// Two neighbouring pixels along an axis and the share of the second one.
struct PixelPair {
  int first, second;
  float share;
};
/// \param place  in pixels; beyond the middles of the outer pixels, these are taken
PixelPair pixelsAt(double place, int count) {
  const double inside = std::clamp(place, 0.0, double(count - 1));
  const int first = int(inside);
  return {first, std::min(first + 1, count - 1), float(inside - first)};
}

/// Enlarges a picture of the same camera to a resolution.
class Enlarged {
 public:
  Enlarged(const Image& from, const Camera& camera, Resolution r)
      : from_(from), fine_(camera, r), coarse_(camera, {from.width, from.height}) {
    for (int column = 0; column < r.width; ++column)
      columns_.push_back(pixelsAt(coarse_.columnAt(fine_.planeX(column)), from.width));
    image_ = {r.width, r.height, {}};
    image_.rgba.reserve(std::size_t(4) * std::size_t(r.width) * std::size_t(r.height));
    for (int row = 0; row < r.height; ++row)
      addRow(pixelsAt(coarse_.rowAt(fine_.planeY(row)), from.height));
  }
  [[nodiscard]] Image take() { return std::move(image_); }

 private:
  void addRow(const PixelPair& rows) {
    for (const PixelPair& columns : columns_)
      for (int channel = 0; channel < 4; ++channel)
        image_.rgba.push_back(mix(along(rows.first, columns, channel),
                                  along(rows.second, columns, channel), rows.share));
  }
  [[nodiscard]] float along(int row, const PixelPair& columns, int channel) const {
    return mix(at(row, columns.first, channel), at(row, columns.second, channel), columns.share);
  }
  [[nodiscard]] float at(int row, int column, int channel) const {
    const std::size_t pixel = std::size_t(row) * std::size_t(from_.width) + std::size_t(column);
    return from_.rgba[4 * pixel + std::size_t(channel)];
  }
  static float mix(float a, float b, float share) { return a + share * (b - a); }

  const Image& from_;
  const View fine_, coarse_;
  std::vector<PixelPair> columns_;
  Image image_;
};

}  // namespace

ProgressivePicture::ProgressivePicture(Renderer& renderer, RenderOptions options)
    : renderer_(renderer), options_(std::move(options)) {
  checkRenderOptions(options_, options_.further.size() + 1);  // the renderer checks their number
}

bool ProgressivePicture::refine(double seconds) try {
  const auto begin = std::chrono::steady_clock::now();
  for (double last = 0.0; !complete();) {
    drawPass();
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    constexpr double kMorePixels = 4.0;  // than in the pass before
    const double next = kMorePixels * (passed.count() - last);
    last = passed.count();
    if (last + next > seconds) break;
  }
  show();
  return complete();
} catch (...) {
  show();
  throw;
}

void ProgressivePicture::drawPass() {
  RenderOptions pass = options_;
  pass.resolution = coarser(options_.resolution, side_);
  drawn_ = renderer_.draw(pass);
  side_ /= 2;
}

/// Enlarges the last pass. It is done once for all passes of a call, because it takes longer than
/// drawing where a GPU draws.
void ProgressivePicture::show() {
  if (!drawn_) return;
  image_ = complete() ? std::move(*drawn_)
                      : Enlarged(*drawn_, options_.camera, options_.resolution).take();
  drawn_.reset();
}

}  // namespace esvr
