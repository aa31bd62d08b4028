#pragma once
/// The directory of a .nvdb file and the bytes of its grids. They are read here, because NanoVDB
/// does not check sizes. In the layout of NanoVDB's major version 32, a file consists of segments:
/// each has a header of 16 bytes, then 176 bytes and a name for each grid, and then the buffer of
/// each grid, compressed as the header says.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

/// The directory's entry for one grid. The numbers of its type and class are NanoVDB's.
struct NanoEntry {
  std::string name;
  std::uint32_t gridType = 0;
  std::uint32_t gridClass = 0;
  std::uint64_t activeVoxels = 0;
  Box activeBox;
  std::uint16_t codec = 0;
  std::uint64_t gridBytes = 0;  ///< size in memory
  std::uint64_t storedBytes = 0;
  std::uint64_t at = 0;
};

/// True if the file begins as a NanoVDB file does.
bool beginsAsNanoVdb(InputFile& file);

/// \throws BadInput  the file has another version, is a grid buffer without a header, or is damaged
std::vector<NanoEntry> readNanoDirectory(InputFile& file);

/// The buffer of a grid, with the alignment that NanoVDB needs.
class NanoBuffer {
 public:
  explicit NanoBuffer(std::size_t bytes)
      : bytes_(static_cast<std::byte*>(::operator new(bytes, kAlignment))), size_(bytes) {}
  [[nodiscard]] std::byte* data() const { return bytes_.get(); }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Free {
    void operator()(std::byte* bytes) const { ::operator delete(bytes, kAlignment); }
  };
  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_;
};

/// \throws BadInput  the buffer is damaged
/// \throws MemoryExceeded  the buffer is larger than maxBytes
NanoBuffer readNanoBuffer(InputFile& file, const NanoEntry& entry, std::uint64_t maxBytes);

}  // namespace esvr::vdb
