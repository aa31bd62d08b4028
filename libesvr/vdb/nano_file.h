#pragma once
/// A .nvdb file's directory and the bytes of its grids. Read here and not by NanoVDB, which
/// believes every size it finds. The layout (NanoVDB's major version 32): segments, each a header
/// of 16 bytes, per grid 176 bytes and a name, then per grid its buffer, compressed as the header
/// says.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "esvr/coord.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

/// One grid's row of the directory. Numbers of type and class are NanoVDB's.
struct NanoEntry {
  std::string name;
  std::uint32_t gridType = 0;
  std::uint32_t gridClass = 0;
  std::uint64_t activeVoxels = 0;
  Box activeBox;
  std::uint16_t codec = 0;
  std::uint64_t gridBytes = 0;  ///< in memory
  std::uint64_t storedBytes = 0;
  std::uint64_t at = 0;
};

/// True where the file begins as one of NanoVDB's does.
bool beginsAsNanoVdb(InputFile& file);

/// \throws BadInput  another version, a bare grid buffer, damaged
std::vector<NanoEntry> readNanoDirectory(InputFile& file);

/// A grid's buffer, aligned as NanoVDB wants it.
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

/// \throws BadInput  damaged; MemoryExceeded: larger than maxBytes
NanoBuffer readNanoBuffer(InputFile& file, const NanoEntry& entry, std::uint64_t maxBytes);

}  // namespace esvr::vdb
