#include "cli/frame_output.h"

#include <fstream>
#include <span>
#include <system_error>

#include "core/atomic_file.h"
#include "esvr/error.h"

namespace esvr::cli {

namespace fs = std::filesystem;

FrameFolder::FrameFolder(const fs::path& output) {
  std::error_code error;
  for (fs::path folder = output.parent_path(); !folder.empty() && !fs::exists(folder, error);
       folder = folder.parent_path())
    made_.push_back(folder);
  if (!made_.empty() && !fs::create_directories(made_.front(), error) && error)
    throw RuntimeFailure("cannot write " + output.string() + ": " + error.message());
}

FrameFolder::~FrameFolder() {
  std::error_code isNotEmpty;
  for (const fs::path& folder : made_) fs::remove(folder, isNotEmpty);
}

void copyOutput(const fs::path& from, const fs::path& to, bool overwrite) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  const FrameFolder folder(to);
  std::ifstream input(from, std::ios::binary);
  AtomicFile output(to, overwrite);
  std::vector<char> block(kBlock);
  while (input.read(block.data(), std::streamsize(block.size())) || input.gcount() > 0)
    output.write(std::as_bytes(std::span(block.data(), std::size_t(input.gcount()))));
  if (!input.eof()) throw RuntimeFailure("cannot read " + from.string());
  output.commit();
}

}  // namespace esvr::cli
