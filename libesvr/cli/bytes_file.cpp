#include "cli/bytes_file.h"

#include "core/atomic_file.h"

namespace esvr::cli {

void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                bool overwrite) {
  AtomicFile file(path, overwrite);
  file.write(bytes);
  file.commit();
}

}  // namespace esvr::cli
