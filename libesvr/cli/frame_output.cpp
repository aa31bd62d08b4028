#include "cli/frame_output.h"

#include <fstream>
#include <span>

#include "core/atomic_file.h"
#include "esvr/error.h"

namespace esvr::cli {

namespace fs = std::filesystem;

void copyOutput(const fs::path& from, const fs::path& to, bool overwrite) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::ifstream input(from, std::ios::binary);
  AtomicFile output(to, overwrite);
  std::vector<char> block(kBlock);
  while (input.read(block.data(), std::streamsize(block.size())) || input.gcount() > 0)
    output.write(std::as_bytes(std::span(block.data(), std::size_t(input.gcount()))));
  if (!input.eof()) throw RuntimeFailure("cannot read " + from.string());
  output.commit();
}

}  // namespace esvr::cli
