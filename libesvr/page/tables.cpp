#include <algorithm>
#include <memory>
#include <vector>

#include "capi/objects.h"
#include "page/page.h"
#include "render/sample_rule.h"
#include "render/transfer_table.h"

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

float weakGradientSquared(const TransferFunction& f) {
  return lightRule({}, View({}, {}), f).weakSquared;  // the same for every view
}

void copy(const SegmentEntry& entry, float (&to)[4]) { std::copy_n(entry.mean.c, 4, to); }

/// Tables, and what their pointers point to.
struct Tables : page_tables {
  Tables(const TransferFunction& f, const page_sampling& sampling)
      : page_tables{}, table(f, Sampling{sampling.length, sampling.side > 1}) {
    const TransferTableView view = table.view();
    intervals = TransferTableView::kIntervals;
    low = view.low, scale = view.scale;
    weak_gradient_squared = weakGradientSquared(f);
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
    copy(view.entries[0], below);
    copy(view.entries[intervals + 1], above);
  }
};

}  // namespace
}  // namespace esvr::page

using namespace esvr;

page_tables* page_make_tables(const page_transfer* transfer, const page_sampling* sampling) {
  std::unique_ptr<page::Tables> tables;
  (void)capi::guarded(
      [&] { tables = std::make_unique<page::Tables>(page::functionOf(*transfer), *sampling); });
  return tables.release();
}

void page_free_tables(page_tables* tables) { delete static_cast<page::Tables*>(tables); }
