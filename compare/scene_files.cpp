#include "compare/scene_files.h"

#include "esvr/error.h"

namespace esvr::compare {
namespace {

VolumeGrid readReference(const GridFile& file, std::size_t place) {
  VolumeGrid reference = file.read(place);
  if (activeVoxelCount(reference.volume) == 0)
    throw BadInput(file.path().string() + ": grid \"" + file.grids()[place].uniqueName +
                   "\" has no active voxel");
  return reference;
}

}  // namespace

SceneFiles::SceneFiles(const TableOptions& options, const CancelToken& cancel)
    : options_(options),
      cancel_(cancel),
      file_(options.reference, options.memory),
      place_(options.grid ? file_.find(*options.grid) : file_.firstWithVoxels()),
      reference_(readReference(file_, place_)),
      box_(options.box.value_or(activeBox(reference_.volume))),
      peak_(options.peak.value_or(peakOf(reference_.volume))) {
  if (options.images.views > 0)
    gallery_.emplace(options.images, reference_.volume, selectDevice(options.device),
                     folder_.path(), cancel);
}

TableScene SceneFiles::scene() const {
  return {options_,
          file_.grids()[place_].uniqueName,
          reference_,
          file_.metadata(),
          box_,
          peak_,
          folder_.path(),
          cancel_,
          gallery_ ? &*gallery_ : nullptr};
}

TableRecord SceneFiles::record() const {
  TableRecord record;
  record.grid = file_.grids()[place_].uniqueName;
  record.referenceBytes = file_.bytes();
  record.box = box_;
  record.peak = peak_;
  record.activeVoxels = activeVoxelCount(reference_.volume);
  if (!gallery_) return record;
  record.referencePng = gallery_->referencePng();
  record.referenceCost = gallery_->referenceCost();
  record.drawnOn = deviceName(gallery_->device());
  return record;
}

}  // namespace esvr::compare
