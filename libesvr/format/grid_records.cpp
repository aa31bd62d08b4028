#include "format/grid_records.h"

#include <utility>

#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {
namespace {

constexpr SectionId kJoined{SectionKind::kGridRecords};

std::vector<std::vector<std::byte>> getRecords(SectionReader& sections) {
  const std::uint64_t stored = sections.storedBytes(kJoined);
  const auto content = sections.get(kJoined);
  ByteReader in(content, sections.place(kJoined));
  std::vector<std::vector<std::byte>> records;
  while (in.left() > 0) {
    if (records.size() == stored) in.fail("more records than it has stored bytes");
    records.push_back(in.getBlob());
  }
  return records;
}

}  // namespace

std::vector<std::byte> putRecords(const std::vector<std::vector<std::byte>>& records) {
  ByteWriter out;
  for (const auto& record : records) out.putSized(record);
  return out.take();
}

GridRecords::GridRecords(SectionReader& sections)
    : sections_(sections), isJoined_(sections.has(kJoined)) {
  if (isJoined_) joined_ = getRecords(sections);
}

std::uint32_t GridRecords::count() const {
  return isJoined_ ? std::uint32_t(joined_.size()) : sections_.count(SectionKind::kGrid);
}

std::vector<std::byte> GridRecords::take(std::uint32_t grid) {
  if (!isJoined_) return sections_.get({SectionKind::kGrid, grid});
  if (next_ == joined_.size()) throw BadInput(place(grid) + ": there is no record of it");
  return std::move(joined_[next_++]);
}

std::string GridRecords::place(std::uint32_t grid) const {
  if (!isJoined_) return sections_.place({SectionKind::kGrid, grid});
  return sections_.place(kJoined) + ": grid " + std::to_string(grid);
}

}  // namespace esvr::format
