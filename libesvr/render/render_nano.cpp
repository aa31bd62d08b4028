// Draws a NanoVDB grid on the CPU.
#include <stdexcept>

#include "core/parallel.h"
#include "esvr/render.h"
#include "render/nano_march.h"
#include "render/picture.h"

namespace esvr {
namespace {

template <class Build>
void drawAs(const NanoVolume& volume, const RenderOptions& o, Picture& picture) {
  const auto& grid = *reinterpret_cast<const nanovdb::NanoGrid<Build>*>(volume.data.get());
  const MarchScene scene{picture.view, sampledBox(volume), o.step, clipOf(o),
                         sampleRule(o, picture.table.view(), volume.background)};
  parallelFor(tbb::blocked_range<int>(0, o.resolution.height), [&](const auto& rows) {
    for (int row = rows.begin(); row != rows.end(); ++row)
      for (int column = 0; column < o.resolution.width; ++column) {
        checkCancelled(o);  // a single ray may take a tenth of a second
        picture.set(column, row, marchNano(grid, scene, column, row));
      }
  });
}

}  // namespace

Image renderNano(const NanoVolume& volume, const RenderOptions& options) {
  const PlaceBox box = sampledBox(volume);
  Picture picture(options, box);
  refuseShading(options);
  if (box.low[0] > box.high[0]) return picture.take();
  checkRayLength(binsWithin(box, picture.view, options.step));
  const auto draw = [&] {
    switch (volume.values) {
      case NanoValues::kFloat:
        return drawAs<float>(volume, options, picture);
      case NanoValues::kFp4:
        return drawAs<nanovdb::Fp4>(volume, options, picture);
      case NanoValues::kFp8:
        return drawAs<nanovdb::Fp8>(volume, options, picture);
      case NanoValues::kFp16:
        return drawAs<nanovdb::Fp16>(volume, options, picture);
      case NanoValues::kFpN:
        return drawAs<nanovdb::FpN>(volume, options, picture);
    }
    throw std::logic_error("renderNano: no such values");
  };
  draw();
  return picture.take();
}

}  // namespace esvr
