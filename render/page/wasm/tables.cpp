#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "capi/objects.h"
#include "page.h"
#include "render/transfer_table.h"
#include "render/value_extent.h"

namespace esvr::page {
namespace {

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

/// A gradient of 2 % of the range for each voxel has half of its effect (render/shading.cpp).
float weakGradientSquared(const TransferFunction& f) {
  constexpr double kWeakShare = 0.02;
  const ValueExtent extent = extentOf(f);
  return float(std::pow(kWeakShare * (extent.high - extent.low), 2.0));
}

void copy(const SegmentEntry& entry, float (&to)[4]) { std::copy_n(entry.mean.c, 4, to); }

/// The tables of the last call, and what their pointers point to.
struct Tables {
  Tables(const TransferFunction& f, const page_sampling& sampling)
      : table(f, Sampling{sampling.length, sampling.side > 1}) {
    const TransferTableView view = table.view();
    content.intervals = TransferTableView::kIntervals;
    content.low = view.low, content.scale = view.scale;
    content.weak_gradient_squared = weakGradientSquared(f);
    static_assert(sizeof(Classified) == 4 * sizeof(float));
    content.values = &view.entries->r;
    if (sampling.side > 1) fillSegments(view.segments, sampling);
  }
  TransferTable table;
  std::vector<PixelColor> segments{};
  page_tables content{};

 private:
  void fillSegments(const SegmentTableView& view, const page_sampling& sampling) {
    const double apart = (sampling.last - sampling.first) / (sampling.side - 1);
    const auto valueAt = [&](int i) { return float(sampling.first + i * apart); };
    segments.reserve(std::size_t(sampling.side) * std::size_t(sampling.side));
    for (int j = 0; j < sampling.side; ++j)
      for (int i = 0; i < sampling.side; ++i) segments.push_back(view(valueAt(i), valueAt(j)));
    static_assert(sizeof(PixelColor) == 4 * sizeof(float));
    content.segments = &segments.front().r;
    copy(view.entries[0], content.below);
    copy(view.entries[content.intervals + 1], content.above);
  }
};
std::unique_ptr<Tables> last;

}  // namespace
}  // namespace esvr::page

using namespace esvr;

const page_tables* page_make_tables(const page_transfer* transfer, const page_sampling* sampling) {
  const auto status = capi::guarded([&] {
    page::last = std::make_unique<page::Tables>(page::functionOf(*transfer), *sampling);
  });
  return status == ESVR_OK ? &page::last->content : nullptr;
}
