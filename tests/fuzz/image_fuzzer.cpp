// Reads dense images, as NRRD and as RAW with a layout that the first bytes choose.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "esvr/error.h"
#include "fuzz/input_file.h"
#include "images/image_source.h"

namespace {

using namespace esvr;

constexpr std::size_t kLayoutBytes = 6;
constexpr std::int64_t kMaxVoxels = 1 << 20;

samples::RawLayout layoutFrom(const std::uint8_t* bytes) {
  constexpr std::array kTypes{"uint8",  "int8",  "uint16",  "int16",
                              "uint32", "int32", "float32", "float64"};
  return {.size = {bytes[0] - 1, bytes[1] - 1, bytes[2] - 1},
          .type = kTypes[bytes[3] % kTypes.size()],
          .bigEndian = bytes[4] % 2 == 1,
          .headerBytes = bytes[5]};
}

void readAll(samples::ImageSource& image) {
  const Coord size = image.size();
  const std::int64_t slice = std::int64_t(size.x) * size.y;
  if (slice > kMaxVoxels) return;
  std::vector<float> values(static_cast<std::size_t>(slice));
  for (std::int32_t z = 0; z < size.z && z < 4; ++z) image.read({z, 1}, values);
  (void)image.indexToWorld();
}

template <class Open>
void tryTo(const Open& open) {
  try {
    readAll(*open());
  } catch (const BadInput&) {
  } catch (const UsageError&) {
  } catch (const MemoryExceeded&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::InputFile nrrd(".nrrd"), raw(".raw");
  tryTo([&] { return samples::openNrrd(nrrd.write(data, size)); });
  if (size < kLayoutBytes) return 0;
  const auto& path = raw.write(data + kLayoutBytes, size - kLayoutBytes);
  tryTo([&] { return samples::openRaw(path, layoutFrom(data)); });
  return 0;
}
