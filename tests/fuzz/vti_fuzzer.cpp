// Reads the first slices of VTK's XML image data, of the first array that there is.

#include <cstdint>
#include <vector>

#include "esvr/error.h"
#include "fuzz/input_file.h"
#include "images/image_source.h"

namespace {

using namespace esvr;

constexpr std::int64_t kMaxVoxels = 1 << 12;

void readSlices(samples::ImageSource& image) {
  const Coord size = image.size();
  const std::int64_t slice = std::int64_t(size.x) * size.y;
  (void)image.indexToWorld();
  if (slice > kMaxVoxels) return;
  std::vector<float> values(static_cast<std::size_t>(slice));
  for (std::int32_t z = 0; z < size.z && z < 4; ++z) image.read({z, 1}, values);
  image.read({0, 1}, values);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::InputFile file(".vti");
  const auto& path = file.write(data, size);
  try {
    readSlices(*samples::openVti(path, {.component = 0}));
  } catch (const BadInput&) {
  } catch (const UsageError&) {
  } catch (const MemoryExceeded&) {
  }
  return 0;
}
