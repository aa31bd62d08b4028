// Plan: the readers of .esvr files get any bytes, unchanged and with corrected checksums, within a memory limit: whole
// files, parts of them, the C interface, sequences and frames.

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/esvr.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "fit/volumes.h"
#include "format/bytes.h"
#include "format/section_reader.h"
#include "fuzz/fuzzer.h"

namespace esvr::fuzz {
namespace {

constexpr std::uint64_t kMaxContent = std::uint64_t{256} << 20, kMaxPart = std::uint64_t{64} << 20,
                        kMaxVoxels = std::uint64_t{8} << 20;
/// Bytes in front of the file, by which fuzzers choose what they ask for.
constexpr std::size_t kChoiceBytes = 4;

void decodeVoxels(const StoredGrid& grid) {
  try {
    checkInvariants(decodeGrid(grid, {.maxBytes = kMaxVoxels}));
  } catch (const MemoryExceeded&) {
  } catch (const RuntimeFailure&) {  // supports are 2^31 voxels apart
  }
}

void decodeAndEncode(std::span<const std::byte> bytes) {
  std::vector<std::byte> once;
  try {
    const EsvrFile file = format::decode(format::MemorySource(bytes, "fuzz"), {kMaxContent});
    for (const auto& grid : file.grids) decodeVoxels(grid);
    once = encodeEsvr(file);
  } catch (const BadInput&) {
    return;
  } catch (const MemoryExceeded&) {
    return;
  }
  require(encodeEsvr(decodeEsvr(once, "again")) == once);
}

/// Decodes any bytes, unchanged and with corrected checksums, within a memory limit. A file that is
/// accepted must be encoded to bytes that decode to the same content, and its grids become voxels or
/// are refused.
ESVR_FUZZER(decode) {
  const auto bytes = std::as_bytes(std::span(data, size));
  decodeAndEncode(bytes);
  decodeAndEncode(repaired(bytes));
  return 0;
}

Box boxFrom(const std::uint8_t* choice) {
  const Coord corner{choice[1] % 64 - 32, choice[2] % 64 - 32, choice[3] % 64 - 32};
  return {corner, corner + Coord{15, 7, 30}};
}

ReadPart partFrom(const std::uint8_t* choice) {
  ReadPart part;
  part.limits.maxBytes = kMaxPart;
  if (choice[0] & 1) part.layers = 1 + choice[1] % 4;
  if (choice[0] & 2) part.ellipsoids = 1 + choice[2];
  if (choice[0] & 4) part.box = boxFrom(choice);
  if (choice[0] & 8) part.grids = std::vector<std::size_t>{choice[1] % std::size_t{4}};
  part.carriedBytes = (choice[0] & 16) != 0;
  return part;
}

void decode(const StoredGrid& grid, const std::optional<Box>& box) {
  try {
    checkInvariants(decodeGrid(grid, {.box = box, .maxBytes = kMaxVoxels}));
  } catch (const MemoryExceeded&) {
  } catch (const RuntimeFailure&) {  // supports are 2^31 voxels apart
  }
}

void readAndDecode(const std::filesystem::path& path, const ReadPart& part, std::size_t count) {
  const PartOfFile read = readEsvrPart(path, part);
  for (const StoredGrid& grid : read.file.grids) {
    decode(grid, part.box);
    decode(firstLayers(grid, 1), part.box);
    decode(heaviest(grid, count), part.box);
  }
}

/// Reads parts of an .esvr file with corrected checksums: some layers, some ellipsoids, a box, and
/// coarser levels of detail of the result. The first bytes choose the part. If the whole file is
/// valid, a part of it must be readable, and its voxels become a valid volume or are refused.
ESVR_FUZZER(part) {
  static InputFile file(".esvr");
  if (size < kChoiceBytes) return 0;
  const auto bytes = repaired(std::as_bytes(std::span(data + kChoiceBytes, size - kChoiceBytes)));
  try {
    readAndDecode(file.write(bytes.data(), bytes.size()), partFrom(data), 1 + data[3] % 16);
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
  return 0;
}

constexpr std::size_t kPlaces = 3;
constexpr int kBoxSide = 12;

/// Whether a call succeeded; a failure must have a text and a status of the interface.
bool succeeded(esvr_status status) {
  if (status == ESVR_OK) return true;
  require(status == ESVR_FAILED || status == ESVR_USAGE || status == ESVR_BAD_INPUT ||
          status == ESVR_MEMORY);
  require(*esvr_error() != '\0');
  return false;
}

std::int32_t coordinate(std::uint8_t choice) { return std::int32_t(choice) - 64; }

/// Places within reach, at the edge of what there is, and where nothing is.
std::vector<double> placesFrom(const std::uint8_t* choice) {
  const double far = choice[3] & 1 ? std::numeric_limits<double>::infinity() : 1e30;
  return {choice[0] / 3.0, choice[1] / 3.0, choice[2] / 3.0, far, 0.0, 0.0, -0.5, 2e9,
          choice[0] + 0.0};
}

/// \param hasGaps  whether values may be NaN
void readVolume(esvr_volume* volume, bool hasGaps, const std::vector<double>& places) {
  for (std::size_t b = 0; b < esvr_brick_count(volume); ++b) {
    esvr_brick brick{};
    require(esvr_get_brick(volume, b, &brick) == ESVR_OK);
    for (std::size_t i = 0; i < ESVR_BRICK_VOXELS; ++i)
      require(hasGaps || !std::isnan(brick.values[i]));
  }
  esvr_brick none{};
  require(esvr_get_brick(volume, esvr_brick_count(volume), &none) == ESVR_USAGE);
  std::vector<float> values(kPlaces);
  (void)succeeded(esvr_sample(volume, kPlaces, places.data(), values.data()));
}

void readEllipsoids(const esvr_file* file, std::size_t grid, std::uint64_t count) {
  if (count == 0) return;
  std::vector<esvr_ellipsoid> all(count);
  require(esvr_get_ellipsoids(file, grid, 0, count, all.data()) == ESVR_OK);
  require(esvr_get_ellipsoids(file, grid, 1, count, all.data()) == ESVR_USAGE);
}

void readOpened(const esvr_file* file, std::size_t grid, const std::uint8_t* choice) {
  esvr_grid description{};
  description.size = sizeof description;
  require(esvr_get_grid(file, grid, &description) == ESVR_OK);
  readEllipsoids(file, grid, description.ellipsoids);

  const std::vector<double> places = placesFrom(choice);
  std::vector<float> at(kPlaces);
  (void)succeeded(esvr_evaluate(file, grid, kPlaces, places.data(), at.data()));

  const std::int32_t x = coordinate(choice[0]), y = coordinate(choice[1]),
                     z = coordinate(choice[2]);
  const std::int32_t box[] = {x, y, z, x + kBoxSide - 1, y + kBoxSide - 1, z + kBoxSide - 1};
  std::vector<float> values(kBoxSide * kBoxSide * kBoxSide);
  std::vector<std::uint8_t> active(values.size());
  (void)succeeded(esvr_decode_box(file, grid, box, kMaxPart, values.data(), active.data()));

  esvr_volume* volume = nullptr;
  const esvr_status status =
      esvr_decode(file, grid, choice[3] & 2 ? box : nullptr, kMaxPart, &volume);
  require(succeeded(status) == (volume != nullptr));
  const std::unique_ptr<esvr_volume, void (*)(esvr_volume*)> owned(volume, esvr_free_volume);
  if (volume) readVolume(volume, description.nonfinite > 0, places);
}

/// Opens files with corrected checksums by the C interface, and asks for all that it gives: grids,
/// ellipsoids, voxels of a box and of the whole grid, and values at places. The first bytes choose
/// the box and the places. Whatever the file, a call succeeds or gives a status with a text.
ESVR_FUZZER(capi) {
  if (size < kChoiceBytes) return 0;
  const auto bytes = repaired(std::as_bytes(std::span(data + kChoiceBytes, size - kChoiceBytes)));
  esvr_file* file = nullptr;
  const esvr_status status =
      esvr_open_memory(bytes.data(), bytes.size(), "fuzzed.esvr", kMaxPart, &file);
  require(succeeded(status) == (file != nullptr));
  const std::unique_ptr<esvr_file, void (*)(esvr_file*)> owned(file, esvr_close);
  for (std::size_t g = 0; g < esvr_grid_count(file); ++g) readOpened(file, g, data);
  for (std::size_t c = 0; c <= esvr_carried_count(file); ++c)
    require(esvr_carried_name(file, c) != nullptr);
  return 0;
}

void read(SequenceReader& reader, std::int64_t number) {
  try {
    (void)reader.read(number);
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
}

void readAll(const std::filesystem::path& path) {
  try {
    SequenceReader reader(path, {kMaxPart});
    for (const SequenceFrame& frame : reader.frames()) read(reader, frame.number);
    for (auto frame = reader.frames().rbegin(); frame != reader.frames().rend(); ++frame)
      read(reader, frame->number);
    (void)checkSequence(path, {kMaxPart});
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
}

/// \return the number of frames that the partial file has
std::size_t finish(const std::filesystem::path& path) {
  SequenceWriter writer(path, {.overwrite = true, .partial = PartialSequence::kResume});
  const std::size_t frames = writer.frames().size();
  if (frames > 0) (void)writer.finish();
  return frames;
}

void resume(const InputFile& partial) {
  std::filesystem::path path = partial.path();
  path.replace_extension();  // without ".partial"
  try {
    const std::size_t frames = finish(path);
    require(frames == 0 || SequenceReader(path).frames().size() == frames);
  } catch (const BadInput&) {    // no partial file
  } catch (const UsageError&) {  // that of a run with other options
  }
  std::filesystem::remove(path);
}

/// Reads every frame of a sequence, in order and backward, unchanged and with corrected checksums,
/// and continues the bytes as a partial file. Frames are decoded or refused; what a writer keeps of a
/// partial file must be readable after it is finished.
ESVR_FUZZER(sequence) {
  static InputFile file(".esvr"), partial(".esvr.partial");
  readAll(file.write(data, size));
  const auto bytes = repaired(std::as_bytes(std::span(data, size)));
  readAll(file.write(bytes.data(), bytes.size()));
  (void)partial.write(data, size);
  resume(partial);
  return 0;
}

SparseVolume volume() { return test::tubeVolume(); }

EsvrFile frameOfVoxels() {
  auto layer = boundedLayer(volume(), 0.02, Activity::kByValue);
  return {{}, {makeStoredVoxels({}, volume(), std::move(layer))}};
}

void decodeAndEncode(std::span<const std::byte> bytes, const EsvrFile& previous) {
  try {
    const auto frame = decodeFrame(bytes, "fuzz", {kMaxContent}, &previous);
    const auto once = encodeFrame(frame, &previous);
    const auto again = decodeFrame(once, "again", {}, &previous);
    require(encodeFrame(again, &previous) == once);
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
}

/// Decodes any bytes as a frame after a small frame of voxels, within a memory limit, unchanged and with
/// corrected checksums. A frame that is accepted must be encoded to bytes that decode to the same
/// content.
ESVR_FUZZER(frame) {
  const auto bytes = std::as_bytes(std::span(data, size));
  static const EsvrFile previous = frameOfVoxels();
  decodeAndEncode(bytes, previous);
  decodeAndEncode(repaired(bytes), previous);
  return 0;
}

}  // namespace
}  // namespace esvr::fuzz
