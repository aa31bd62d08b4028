#include "compare/external.h"

#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "compare/grid_file.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "programs/option_values.h"
#include "programs/run_main.h"

namespace esvr::compare {

// Commands in a shell.

namespace {

std::string lastLine(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  const std::size_t begin = text.rfind('\n');
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

[[noreturn]] void fail(const std::string& command, const std::string& option, int status,
                       const std::string& output) {
  const std::string end = WIFEXITED(status) ? "code " + std::to_string(WEXITSTATUS(status))
                                            : "signal " + std::to_string(WTERMSIG(status));
  const std::string last = lastLine(output);
  throw RuntimeFailure(option + ": " + command + " ended with " + end +
                       (last.empty() ? "" : ": " + last));
}

/// What `shell` prints. It runs `command`, which is named if it fails.
std::string printed(const std::string& shell, const std::string& command,
                    const std::string& option) {
  FILE* pipe = popen(shell.c_str(), "r");
  if (!pipe) throw RuntimeFailure(option + ": cannot run " + command);
  std::string text;
  std::array<char, 256> part{};
  while (std::fgets(part.data(), int(part.size()), pipe)) text += part.data();
  const int status = pclose(pipe);
  if (status != 0) fail(command, option, status, text);
  return text;
}

/// Runs a command whose output and messages matter only if it fails.
void runCommand(const std::string& command, const std::string& option) {
  (void)printed("{ " + command + "\n} 2>&1", command, option);
}

}  // namespace

std::string outputOf(const std::string& command, const std::string& option) {
  return printed(command, command, option);
}

// Results of other systems.

namespace {

struct TypeWord {
  const char* word;
  std::size_t bytes;
};
constexpr std::array kTypes{TypeWord{"float32", 4}, TypeWord{"float64", 8}, TypeWord{"uint8", 1},
                            TypeWord{"uint16", 2}};

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw UsageError("--external '" + text + "': " + why +
                   "; the form is NAME=FILE:BYTES, with :NXxNYxNZ:TYPE if FILE is raw, and any "
                   "of :encode=S, :decode=S, :fps=N");
}

std::optional<Coord> parseDims(const std::string& text) {
  std::vector<std::int32_t> sides;
  for (const std::string& part : cli::splitText(text, 'x')) {
    const auto side = cli::parseWhole(part);
    if (!side || *side < 1 || *side > Box::kMax) return std::nullopt;
    sides.push_back(std::int32_t(*side));
  }
  if (sides.size() != 3) return std::nullopt;
  return Coord{sides[0], sides[1], sides[2]};
}

/// The bytes of a value; 0 if the word is no type.
std::size_t bytesOf(const std::string& type) {
  for (const auto& known : kTypes)
    if (type == known.word) return known.bytes;
  return 0;
}

/// Reads a part like "encode=4.2". \return false if it is not of this form
bool readFigure(const std::string& part, External& external) {
  const std::size_t equals = part.find('=');
  if (equals == std::string::npos) return false;
  const std::string key = part.substr(0, equals);
  const auto value = cli::parseNumber(part.substr(equals + 1));
  if (!value || *value < 0.0) return false;
  if (key == "encode")
    external.encodeSeconds = value;
  else if (key == "decode")
    external.decodeSeconds = value;
  else if (key == "fps")
    external.fps = value;
  else
    return false;
  return true;
}

void readPart(const std::string& part, External& external) {
  if (readFigure(part, external)) return;
  if (const auto dims = parseDims(part))
    external.dims = dims;
  else if (bytesOf(part) > 0)
    external.type = part;
  else
    refuse(external.text, "'" + part + "' is not understood");
}

}  // namespace

External parseExternal(const std::string& text) {
  External external;
  external.text = text;
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) refuse(text, "it has no name");
  external.name = text.substr(0, equals);
  const auto parts = cli::splitText(text.substr(equals + 1), ':');
  if (parts.size() < 2 || parts[0].empty()) refuse(text, "it has no file and bytes");
  external.file = parts[0];
  external.bytes = cli::parseByteSize("external", parts[1]);
  for (std::size_t i = 2; i < parts.size(); ++i) readPart(parts[i], external);
  if (external.dims.has_value() == external.type.empty())
    refuse(text, "dimensions and a type come together");
  return external;
}

namespace {

Coord sideOf(const Box& box) { return box.max - box.min + Coord{1, 1, 1}; }

template <class T>
float valueAt(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return float(value);
}

float valueOf(const std::string& type, const std::byte* from) {
  static_assert(std::endian::native == std::endian::little);
  if (type == "float64") return valueAt<double>(from);
  if (type == "uint8") return valueAt<std::uint8_t>(from);
  if (type == "uint16") return valueAt<std::uint16_t>(from);
  return valueAt<float>(from);
}

/// Checks the size of a raw file.
void checkRaw(const External& external, const Box& box) {
  const std::string file = external.file.string() + ": ";
  const Coord side = sideOf(box);
  if (*external.dims != side)
    throw BadInput(file + toString(*external.dims) + " voxels, but the box that is compared has " +
                   toString(side));
  std::error_code error;
  const auto size = std::filesystem::file_size(external.file, error);
  if (error) throw BadInput(file + error.message());
  const double wanted = box.volume() * double(bytesOf(external.type));
  if (double(size) != wanted)
    throw BadInput(file + std::to_string(size) + " bytes, but " + toString(side) + " voxels of " +
                   external.type + " take " + std::to_string(std::uint64_t(wanted)));
}

/// Reads a raw file slice by slice (z is slowest) into bricks.
class RawReader {
 public:
  RawReader(const External& external, const ExternalPlace& place)
      : external_(external), place_(place), stream_(external.file, std::ios::binary) {}

  SparseVolume read() {
    const Box& box = place_.box;
    std::vector<BrickInput> bricks;
    for (int z = brickOf(box.min).z; z <= brickOf(box.max).z; ++z) appendLayer(z, bricks);
    return makeVolume(std::move(bricks), place_.background);
  }

 private:
  /// Appends the bricks of one layer along z.
  void appendLayer(int brickZ, std::vector<BrickInput>& bricks) {
    const Coord first = brickOf(place_.box.min), last = brickOf(place_.box.max);
    const auto [nx, ny] = std::array{last.x - first.x + 1, last.y - first.y + 1};
    BrickInput empty{};
    empty.values.fill(place_.background);
    std::vector<BrickInput> layer(std::size_t(nx) * std::size_t(ny), empty);
    for (int x = 0; x < nx; ++x)
      for (int y = 0; y < ny; ++y)
        layer[std::size_t(x) * ny + y].corner =
            Coord{first.x + x, first.y + y, brickZ} * kBrickSide;
    const int begin = std::max(brickZ * kBrickSide, place_.box.min.z);
    const int end = std::min(brickZ * kBrickSide + kBrickSide - 1, place_.box.max.z);
    for (int z = begin; z <= end; ++z) readSlice(z, ny, layer);
    for (const auto& brick : layer)
      if (brick.active.count() > 0) bricks.push_back(brick);
  }

  void readSlice(int z, int ny, std::vector<BrickInput>& layer) {
    const Box& box = place_.box;
    const std::size_t bytes = bytesOf(external_.type);
    row_.resize(std::size_t(box.max.x - box.min.x + 1) * bytes);
    for (int y = box.min.y; y <= box.max.y; ++y) {
      stream_.read(reinterpret_cast<char*>(row_.data()), std::streamsize(row_.size()));
      if (!stream_) throw BadInput(external_.file.string() + ": cannot be read");
      for (int x = box.min.x; x <= box.max.x; ++x)
        set({x, y, z}, valueOf(external_.type, &row_[std::size_t(x - box.min.x) * bytes]), ny,
            layer);
    }
  }

  void set(Coord voxel, float value, int ny, std::vector<BrickInput>& layer) const {
    if (!std::isfinite(value))
      throw BadInput(external_.file.string() + ": the value at " + toString(voxel) +
                     " is not finite");
    const Coord brick = brickOf(voxel) - brickOf(place_.box.min);
    BrickInput& to = layer[std::size_t(brick.x) * ny + brick.y];
    const int offset = voxelOffset(localOf(voxel));
    to.values[offset] = value;
    if (value != place_.background) to.active.set(offset);
  }

  const External& external_;
  const ExternalPlace& place_;
  std::ifstream stream_;
  std::vector<std::byte> row_;
};

SparseVolume readVdb(const External& external, const ExternalPlace& place) {
  const GridFile file(external.file, place.memory);
  return file.read(file.grids().size() == 1 ? 0 : file.find(place.grid)).volume;
}

}  // namespace

SparseVolume readExternal(const External& external, const ExternalPlace& place) {
  if (!external.dims) return readVdb(external, place);
  checkRaw(external, place.box);
  return RawReader(external, place).read();
}

// Compressors that a command runs.

namespace {

constexpr const char* kOption = "--external-command";

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
  for (const auto& word :
       {from.string(), to.string(), std::to_string(side.x), std::to_string(side.y),
        std::to_string(side.z), cli::exactNumber(bound_)})
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

// The search for a bound.

namespace {

constexpr double kDecade = 10.0;
constexpr int kDecades = 9;         // bounds from the peak to its 1e-9
constexpr int kMaxBisections = 10;  // a step of 10 is then divided into parts of 0.2 %
constexpr double kSufficientFill = 0.98;
constexpr double kSufficientExcess = 0.05;  // dB

/// Tries bounds and keeps the best trial.
class Search {
 public:
  Search(ExternalCodec& codec, const RowGoal& goal)
      : codec_(codec),
        bytes_(std::get_if<std::uint64_t>(&goal)),
        psnr_(std::get_if<MatchGoal>(&goal)) {}

  ExternalMatch run() {
    double coarse = codec_.source().peak;
    bool passed = tooFine(coarse);
    for (int i = 0; i < kDecades && !passed && !ended_; ++i) {
      passed = tooFine(coarse / kDecade);
      if (passed && !ended_)
        bisect(coarse, coarse / kDecade);
      else
        coarse /= kDecade;
    }
    return std::move(match_);
  }

 private:
  void bisect(double coarse, double fine) {
    for (int i = 0; i < kMaxBisections && !ended_; ++i) {
      const double middle = std::sqrt(coarse * fine);
      (tooFine(middle) ? fine : coarse) = middle;
    }
  }

  /// Tries a bound and keeps the trial if it is the best so far.
  bool tooFine(double bound) {
    ExternalStep step{bound, codec_.encode(bound).bytes, std::numeric_limits<double>::quiet_NaN()};
    if (psnr_ || step.bytes <= *bytes_) step.psnr = psnr();
    match_.steps.push_back(step);
    const bool allowed = psnr_ ? step.psnr >= psnr_->psnr : step.bytes <= *bytes_;
    if (allowed && (!match_.found || isBetter(step))) {
      match_.best = step;
      match_.found = true;
    }
    ended_ = allowed && (psnr_ ? step.psnr <= psnr_->psnr + kSufficientExcess
                               : double(step.bytes) >= kSufficientFill * double(*bytes_));
    return psnr_ ? allowed : !allowed;
  }

  [[nodiscard]] bool isBetter(const ExternalStep& step) const {
    return psnr_ ? step.bytes < match_.best.bytes : step.psnr > match_.best.psnr;
  }

  double psnr() {
    const ExternalSource& source = codec_.source();
    const CompareOptions options{.box = source.box, .peak = source.peak};
    const SparseVolume decoded = codec_.decode();
    return psnr_ && psnr_->active ? compareVolumes(source.volume, decoded, options).psnrActive
                                  : psnrOverBox(source.volume, decoded, options);
  }

  ExternalCodec& codec_;
  const std::uint64_t* bytes_;  ///< the goal is one of the two
  const MatchGoal* psnr_;
  ExternalMatch match_;
  bool ended_ = false;
};

}  // namespace

ExternalMatch match(ExternalCodec& codec, const RowGoal& goal) { return Search(codec, goal).run(); }

}  // namespace esvr::compare
