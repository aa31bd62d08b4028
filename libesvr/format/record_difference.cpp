#include "format/record_difference.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "format/grid_record.h"

namespace esvr::format {
namespace {

std::vector<std::byte> recordOf(const StoredGrid& grid) {
  ByteWriter record;
  putGrid(record, grid, {});
  return record.take();
}

std::uint32_t equalBytes(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return std::uint32_t(end - a.begin());
}

std::uint32_t equalBytesAtEnd(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto end = std::mismatch(a.rbegin(), a.rend(), b.rbegin(), b.rend()).first;
  return std::uint32_t(end - a.rbegin());
}

/// Writes the bytes of a record between those that the previous record begins and ends with too.
void putRecord(ByteWriter& out, std::span<const std::byte> record,
               std::span<const std::byte> previous) {
  const std::uint32_t first = equalBytes(record, previous);
  const std::uint32_t last = equalBytesAtEnd(record.subspan(first), previous.subspan(first));
  out.put(first);
  out.put(last);
  out.putSized(record.subspan(first, record.size() - first - last));
}

std::vector<std::byte> getRecord(ByteReader& in, std::span<const std::byte> previous) {
  const auto first = in.get<std::uint32_t>(), last = in.get<std::uint32_t>();
  if (std::uint64_t(first) + last > previous.size())
    in.fail("more bytes of the previous frame's record than it has");
  const auto middle = in.getSized();
  std::vector<std::byte> record(previous.begin(), previous.begin() + first);
  record.insert(record.end(), middle.begin(), middle.end());
  record.insert(record.end(), previous.end() - last, previous.end());
  return record;
}

StoredGrid gridOf(std::span<const std::byte> record, const std::string& where) {
  ByteReader in(record, where);
  GridRecord grid = getGrid(in);
  in.finish();
  if (grid.chunkCount != 0) in.fail("the record has chunks");
  return std::move(grid.grid);
}

}  // namespace

void putRecordAfter(ByteWriter& out, const StoredGrid& grid, const StoredGrid& previous) {
  putRecord(out, recordOf(grid), recordOf(previous));
}

StoredGrid getRecordAfter(ByteReader& in, const StoredGrid& previous, const std::string& where) {
  return gridOf(getRecord(in, recordOf(previous)), where);
}

}  // namespace esvr::format
