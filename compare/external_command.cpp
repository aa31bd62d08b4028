#include "compare/external_command.h"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>

#include "cli/shell_word.h"
#include "cli/stopwatch.h"
#include "compare/external.h"
#include "compare/shell_command.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

constexpr const char* kOption = "--external-command";

Coord sideOf(const Box& box) { return box.max - box.min + Coord{1, 1, 1}; }

void requireRoom(const ExternalSource& source) {
  constexpr double kMegabyte = 1e6;
  const double bytes = source.box.volume() * sizeof(float);
  if (source.maxDense == 0 || bytes <= double(source.maxDense)) return;
  throw UsageError("the box as an array takes " + std::to_string(std::uint64_t(bytes / kMegabyte)) +
                   " MB, more than the bound of " +
                   std::to_string(std::uint64_t(double(source.maxDense) / kMegabyte)));
}

/// The voxels of a box with x fastest.
std::vector<float> arrayOf(const SparseVolume& volume, const Box& box) {
  std::vector<float> array(std::size_t(box.volume()), volume.background);
  const Coord side = sideOf(box);
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i) {
      const Coord voxel = volume.brickCorner(b) + voxelLocal(i);
      if (voxel != minCoord(maxCoord(voxel, box.min), box.max)) continue;
      const Coord at = voxel - box.min;
      array[(std::size_t(at.z) * side.y + at.y) * side.x + at.x] = volume.brickValues(b)[i];
    }
  return array;
}

void writeRaw(const std::filesystem::path& path, const std::vector<float>& array) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(array.data()),
               std::streamsize(array.size() * sizeof(float)));
  if (!stream.flush()) throw RuntimeFailure(path.string() + ": cannot be written");
}

/// Half of the smallest difference between an active voxel and the background.
float activityThreshold(const SparseVolume& volume) {
  float smallest = std::numeric_limits<float>::infinity();
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i) {
      const float difference = std::abs(volume.brickValues(b)[i] - volume.background);
      if (volume.active[b].test(i) && difference > 0.0f) smallest = std::min(smallest, difference);
    }
  return std::isfinite(smallest) ? smallest / 2 : 0.0f;
}

/// Makes voxels inactive that differ from the background by no more than a threshold; they keep
/// their values.
void deactivate(SparseVolume& volume, float threshold) {
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    BrickMask active;
    for (int i = 0; i < kBrickVoxels; ++i)
      if (std::abs(volume.brickValues(b)[i] - volume.background) > threshold) active.set(i);
    volume.active[b] = active;
  }
}

}  // namespace

ExternalCommand parseExternalCommand(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw UsageError(std::string(kOption) + " '" + text + "': the form is NAME=COMMAND");
  return {text, text.substr(0, equals), text.substr(equals + 1)};
}

ExternalCodec::ExternalCodec(const ExternalCommand& command, const ExternalSource& source)
    : command_(command),
      source_(source),
      raw_(source.folder / "external.raw"),
      packed_(source.folder / "external.packed"),
      decoded_(source.folder / "external.decoded.raw") {
  requireRoom(source_);
  activeAbove_ = activityThreshold(source_.volume);
  writeRaw(raw_, arrayOf(source_.volume, source_.box));
}

void ExternalCodec::run(const char* job, const std::filesystem::path& from,
                        const std::filesystem::path& to) const {
  if (source_.cancel && source_.cancel->cancelled()) throw Cancelled();
  std::filesystem::remove(to);
  const Coord side = sideOf(source_.box);
  std::string line = command_.command + " " + job;
  for (const auto& word : {from.string(), to.string(), std::to_string(side.x),
                           std::to_string(side.y), std::to_string(side.z), boundText(bound_)})
    line += " " + cli::shellWord(word);
  runCommand(line, kOption);
  if (!std::filesystem::exists(to))
    throw RuntimeFailure(std::string(kOption) + ": " + line + " wrote no file");
}

ExternalCodec::Encoded ExternalCodec::encode(double bound) {
  bound_ = bound;
  cli::Stopwatch watch;
  run("encode", raw_, packed_);
  const double seconds = watch.lap();
  return {std::filesystem::file_size(packed_), seconds};
}

double ExternalCodec::secondsToDecode() {
  cli::Stopwatch watch;
  run("decode", packed_, decoded_);
  return watch.lap();
}

SparseVolume ExternalCodec::decode() {
  run("decode", packed_, decoded_);
  External raw;
  raw.file = decoded_;
  raw.dims = sideOf(source_.box);
  raw.type = "float32";
  SparseVolume volume =
      readExternal(raw, {{}, source_.box, source_.volume.background, source_.memory});
  deactivate(volume, activeAbove_);
  return volume;
}

std::string boundText(double bound) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), bound).ptr;
  return {text.data(), end};
}

}  // namespace esvr::compare
