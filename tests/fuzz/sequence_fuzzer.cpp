// Reads every frame of a sequence, in order and backward, unchanged and with corrected checksums,
// and continues the bytes as a partial file. Frames are decoded or refused; what a writer keeps of a
// partial file must be readable after it is finished.

#include <cstdint>
#include <cstdlib>
#include <span>

#include "esvr/error.h"
#include "esvr/sequence_file.h"
#include "fuzz/input_file.h"
#include "fuzz/repair.h"

namespace {

using namespace esvr;

constexpr std::uint64_t kMaxContent = std::uint64_t{64} << 20;

void read(SequenceReader& reader, std::int64_t number) {
  try {
    (void)reader.read(number);
  } catch (const BadInput&) {
  } catch (const MemoryExceeded&) {
  }
}

void readAll(const std::filesystem::path& path) {
  try {
    SequenceReader reader(path, {kMaxContent});
    for (const SequenceFrame& frame : reader.frames()) read(reader, frame.number);
    for (auto frame = reader.frames().rbegin(); frame != reader.frames().rend(); ++frame)
      read(reader, frame->number);
    (void)checkSequence(path, {kMaxContent});
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

void resume(const fuzz::InputFile& partial) {
  std::filesystem::path path = partial.path();
  path.replace_extension();  // without ".partial"
  try {
    const std::size_t frames = finish(path);
    if (frames > 0 && SequenceReader(path).frames().size() != frames) std::abort();
  } catch (const BadInput&) {  // no partial file
  }
  std::filesystem::remove(path);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::InputFile file(".esvr"), partial(".esvr.partial");
  readAll(file.write(data, size));
  const auto bytes = fuzz::repaired(std::as_bytes(std::span(data, size)));
  readAll(file.write(bytes.data(), bytes.size()));
  (void)partial.write(data, size);
  resume(partial);
  return 0;
}
