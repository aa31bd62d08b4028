#include "format/sequence_samples.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include "esvr/frame_coding.h"
#include "esvr/sequence_file.h"
#include "format/checksum.h"
#include "format/golden_files.h"
#include "format/sample_files.h"
#include "format/sequence_index.h"

namespace esvr::test {
namespace {

constexpr std::int64_t kEmptyEvery = 5;

void appendTo(std::vector<std::byte>& file, const std::vector<std::byte>& bytes) {
  file.insert(file.end(), bytes.begin(), bytes.end());
  file.resize(format::alignUp(file.size()));
}

void appendChain(std::vector<std::byte>& file, const std::vector<std::int64_t>& numbers,
                 std::vector<format::FrameGroup>& groups) {
  format::FrameGroup group{format::endOf(groups), {}};
  std::vector<std::vector<std::byte>> frames;
  for (const std::int64_t number : numbers) {
    frames.push_back(encodeFrame(sampleFrame(number), nullptr));
    group.frames.push_back(
        {number, frames.back().size(), format::checksum(frames.back()), frames.size() > 1});
  }
  appendTo(file, format::encodeDirectory(group));
  for (const auto& frame : frames) appendTo(file, frame);
  groups.push_back(group);
}

std::vector<std::byte> goldenFrame(const std::string& name) {
  const auto all = goldenFiles();
  const auto golden = std::ranges::find(all, name, &GoldenFile::name);
  return encodeFrame(golden->content, nullptr);
}

}  // namespace

void writeGoldenSequence(const std::filesystem::path& path) {
  SequenceWriter writer(path, {.overwrite = true});
  writer.append(-2, goldenFrame("one_ellipsoid"));
  writer.append(1, goldenFrame("no_grid"));
  writer.endGroup();
  writer.append(3, goldenFrame("voxels"));
  (void)writer.finish();
}

EsvrFile sampleFrame(std::int64_t number) {
  if (number % kEmptyEvery == 0) return {};
  EsvrFile file = fileOf(fogGrid(std::size_t(3 + (number < 0 ? -number : number) % 7)));
  file.grids.front().valueMax += float(number % 3);
  return file;
}

void writeSequence(const std::filesystem::path& path,
                   const std::vector<std::vector<std::int64_t>>& groups) {
  SequenceWriter writer(path);
  for (const auto& group : groups) {
    for (const std::int64_t number : group)
      writer.append(number, encodeFrame(sampleFrame(number), nullptr));
    writer.endGroup();
  }
  (void)writer.finish();
}

void writeChains(const std::filesystem::path& path,
                 const std::vector<std::vector<std::int64_t>>& numbers) {
  std::vector<std::byte> file(format::kHeaderBytes);
  std::vector<format::FrameGroup> groups;
  for (const auto& group : numbers) appendChain(file, group, groups);
  const format::SequenceEnd end = format::encodeEnd(groups);
  file.insert(file.end(), end.bytes.begin(), end.bytes.end());
  std::copy(end.header.begin(), end.header.end(), file.begin());
  writeBytes(path, file);
}

std::vector<std::byte> bytesIn(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return bytesOf(std::string(std::istreambuf_iterator<char>(in), {}));
}

void writeBytes(const std::filesystem::path& path, const std::vector<std::byte>& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}

}  // namespace esvr::test
