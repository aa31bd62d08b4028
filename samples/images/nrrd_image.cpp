#include <teem/biff.h>
#include <teem/nrrd.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "cli/memory.h"
#include "esvr/error.h"
#include "images/image_source.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kAxes = 3;

struct NrrdDeleter {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
};
using NrrdPointer = std::unique_ptr<Nrrd, NrrdDeleter>;

struct IoStateDeleter {
  void operator()(NrrdIoState* state) const { nrrdIoStateNix(state); }
};

/// The innermost reason of teem's last error, which is the last line of its text.
std::string lastReason() {
  char* const text = biffGetDone(NRRD);
  std::string reason = text ? text : "unknown error";
  std::free(text);
  while (!reason.empty() && reason.back() == '\n') reason.pop_back();
  return reason.substr(reason.find_last_of('\n') + 1);
}

NrrdPointer load(const fs::path& path, bool headerOnly) {
  const std::unique_ptr<NrrdIoState, IoStateDeleter> state(nrrdIoStateNew());
  nrrdIoStateSet(state.get(), nrrdIoStateSkipData, headerOnly ? AIR_TRUE : AIR_FALSE);
  NrrdPointer nrrd(nrrdNew());
  if (nrrdLoad(nrrd.get(), path.c_str(), state.get()) != 0)
    throw BadInput("cannot read " + path.string() + ": " + lastReason());
  return nrrd;
}

void checkHeader(const Nrrd& nrrd, const fs::path& path) {
  if (nrrd.dim != kAxes)
    throw BadInput(path.string() + " has " + std::to_string(nrrd.dim) + " axes, not three");
  if (nrrd.type == nrrdTypeBlock)
    throw BadInput(path.string() + " holds blocks instead of numbers");
  double bytes = double(nrrdTypeSize[nrrd.type]);
  for (unsigned a = 0; a < kAxes; ++a) {
    bytes *= double(nrrd.axis[a].size);
    if (nrrd.axis[a].size > std::size_t(std::numeric_limits<std::int32_t>::max()))
      throw BadInput(path.string() + ": an axis is too long");
  }
  if (bytes > double(cli::physicalMemory()))
    throw BadInput(path.string() + " has " + std::to_string(bytes) +
                   " bytes of data, which do not fit into memory");
}

class NrrdImage : public ImageSource {
 public:
  explicit NrrdImage(const fs::path& path) {
    checkHeader(*load(path, true), path);
    nrrd_ = load(path, false);
  }

  [[nodiscard]] Coord size() const override {
    return {std::int32_t(nrrd_->axis[0].size), std::int32_t(nrrd_->axis[1].size),
            std::int32_t(nrrd_->axis[2].size)};
  }

  [[nodiscard]] std::optional<double> typeMaximum() const override {
    if (!nrrdTypeIsIntegral[nrrd_->type]) return std::nullopt;
    return nrrdTypeMax[nrrd_->type];
  }

  /// The transform by space directions and origin, or by the axes' spacings, or the identity.
  [[nodiscard]] std::array<double, 16> indexToWorld() const override {
    std::array<double, 16> m{};
    m[15] = 1.0;
    for (unsigned row = 0; row < kAxes; ++row)
      for (unsigned column = 0; column < kAxes; ++column) m[row * 4 + column] = entry(row, column);
    if (nrrd_->spaceDim == kAxes && nrrdSpaceVecExists(kAxes, nrrd_->spaceOrigin))
      std::copy_n(nrrd_->spaceOrigin, kAxes, &m[12]);
    return m;
  }

  void read(const Slab& slab, std::span<float> out) override {
    const auto lookup = nrrdFLookup[nrrd_->type];
    const std::size_t first = std::size_t(slab.firstZ) * nrrd_->axis[0].size * nrrd_->axis[1].size;
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = lookup(nrrd_->data, first + i);
  }

 private:
  [[nodiscard]] double entry(unsigned axis, unsigned component) const {
    const NrrdAxisInfo& info = nrrd_->axis[axis];
    if (nrrd_->spaceDim == kAxes && nrrdSpaceVecExists(kAxes, info.spaceDirection))
      return info.spaceDirection[component];
    if (axis != component) return 0.0;
    return std::isfinite(info.spacing) && info.spacing != 0.0 ? info.spacing : 1.0;
  }

  NrrdPointer nrrd_;
};

}  // namespace

std::unique_ptr<ImageSource> openNrrd(const fs::path& path) {
  return std::make_unique<NrrdImage>(path);
}

}  // namespace esvr::samples
