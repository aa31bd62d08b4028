#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "images/image_source.h"
#include "images/tiff_file.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

struct Slice {
  std::size_t file = 0;
  std::uint64_t page = 0;
};

/// The place of the user's component in the pages of a file.
struct Place {
  std::size_t channel = 0, sample = 0;
};

Place placeOf(const fs::path& path, const ImageChoice& choice, const StackLayout& layout,
              const TiffFormat& format) {
  const bool oneColor = format.colors == 1 && layout.channels == 1;
  const std::size_t all = layout.channels * format.samples;
  // A gray image with opacity has two samples, and the first one is the image.
  const std::size_t chosen = oneColor && !choice.component ? 0 : chosenComponent(path, choice, all);
  return {chosen / format.samples, chosen % format.samples};
}

std::optional<double> maximumOf(const TiffFormat& format, const fs::path& path) {
  const ElementType* const type = typeOf(format, path);
  return type ? type->maximum : std::optional(std::exp2(double(format.bits)) - 1.0);
}

class TiffImage : public ImageSource {
 public:
  TiffImage(std::vector<fs::path> paths, const ImageChoice& choice) : paths_(std::move(paths)) {
    for (std::size_t i = 0; i < paths_.size(); ++i) addFile(i, choice);
    size_ = checkedSize(paths_.front(), {format_.width, format_.height, slices_.size()});
    requireSlabMemory(paths_.front(), size_, 0);  // the reader checks strips and tiles
    maximum_ = maximumOf(format_, paths_.front());
  }

  [[nodiscard]] Coord size() const override { return size_; }
  [[nodiscard]] std::optional<double> typeMaximum() const override { return maximum_; }
  [[nodiscard]] std::array<double, 16> indexToWorld() const override {
    return scaleMatrix(voxelSize_);
  }

  void read(const Slab& slab, std::span<float> out) override {
    const std::size_t area = std::size_t(size_.x) * std::size_t(size_.y);
    for (std::size_t i = 0; i < std::size_t(slab.slices); ++i)
      readSlice(slices_[std::size_t(slab.firstZ) + i], out.subspan(i * area, area));
  }

 private:
  void openFile(std::size_t index) {
    if (file_ && opened_ == index) return;
    file_.reset();  // before the next one is opened
    file_ = std::make_unique<TiffFile>(paths_[index]);
    opened_ = index;
  }

  void requireFirstFormat(const TiffFormat& format, const fs::path& path) const {
    if (format != format_)
      throw BadInput(path.string() + " has " + textOf(format) + ", but " + paths_.front().string() +
                     " has " + textOf(format_));
  }

  void addFile(std::size_t index, const ImageChoice& choice) {
    const fs::path& path = paths_[index];
    openFile(index);
    const auto pages = file_->pages();
    file_->open(pages.front());
    const StackLayout layout = stackLayout(file_->stackFile(pages.size()));
    if (index == 0) {
      format_ = file_->format();
      voxelSize_ = layout.voxelSize;
    }
    requireFirstFormat(file_->format(), path);
    const Place place = placeOf(path, choice, layout, format_);
    sample_ = place.sample;
    for (const std::size_t page : pagesOf(layout, place.channel))
      slices_.push_back({index, pages[page]});
  }

  void readSlice(const Slice& slice, std::span<float> out) {
    openFile(slice.file);
    file_->open(slice.page);
    requireFirstFormat(file_->format(), paths_[slice.file]);  // the file may have been replaced
    file_->read(sample_, out);
  }

  std::vector<fs::path> paths_;
  TiffFormat format_;
  std::vector<Slice> slices_;
  std::size_t sample_ = 0;
  std::array<double, 3> voxelSize_{1.0, 1.0, 1.0};
  Coord size_;
  std::optional<double> maximum_;
  std::unique_ptr<TiffFile> file_;
  std::size_t opened_ = 0;
};

/// The stack of a file in which ImageJ put all pages behind the first one, which it does above 4 GB.
/// Nothing for other files.
std::unique_ptr<ImageSource> openPagesBehind(const fs::path& path, const ImageChoice& choice) {
  TiffFile file(path);
  const std::size_t images = imageJPages(file.stackFile(1).text).value_or(1);
  if (images < 2 || file.plainData() == 0) return nullptr;
  const auto pages = file.pages();
  if (pages.size() != 1) return nullptr;
  file.open(pages.front());
  const StackLayout layout = stackLayout(file.stackFile(images));
  if (layout.channels != 1)
    throw BadInput(path.string() + " has " + std::to_string(layout.channels) +
                   " channels behind one page, which cannot be read");
  (void)chosenComponent(path, choice, 1);
  const TiffFormat format = file.format();
  const ElementType* const type = typeOf(format, path);
  if (!type) throw BadInput(path.string() + " has packed values behind one page");
  return openRaw(path, {.size = checkedSize(path, {format.width, format.height, images}),
                        .type = type->name,
                        .bigEndian = file.isBigEndian(),
                        .headerBytes = file.plainData(),
                        .voxelSize = layout.voxelSize,
                        .endsWithData = false});
}

}  // namespace

std::unique_ptr<ImageSource> openTiff(const std::vector<fs::path>& paths,
                                      const ImageChoice& choice) {
  for (const fs::path& path : paths) refuseDataset(path, choice);
  if (paths.size() == 1)
    if (auto stack = openPagesBehind(paths.front(), choice)) return stack;
  return std::make_unique<TiffImage>(paths, choice);
}

}  // namespace esvr::samples
