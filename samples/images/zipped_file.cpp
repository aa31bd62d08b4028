#include "images/zipped_file.h"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "esvr/error.h"

namespace esvr::samples {

void ZippedFile::Closer::operator()(gzFile_s* file) const { gzclose(file); }

ZippedFile::ZippedFile(std::filesystem::path path)
    : path_(std::move(path)), file_(gzopen(path_.c_str(), "rb")) {
  if (!file_) throw BadInput("cannot read " + path_.string());
}

std::size_t ZippedFile::read(std::uint64_t place, std::span<std::byte> out) {
  if (place > std::uint64_t(std::numeric_limits<z_off_t>::max())) return 0;
  std::size_t done = 0;
  int count = 1;
  if (gzseek(file_.get(), z_off_t(place), SEEK_SET) < 0) count = -1;
  while (count > 0 && done < out.size()) {
    constexpr std::size_t kMost = std::size_t{1} << 30;  // zlib counts in int
    const auto rest = out.subspan(done, std::min(kMost, out.size() - done));
    count = gzread(file_.get(), rest.data(), unsigned(rest.size()));
    done += count > 0 ? std::size_t(count) : 0;
  }
  int code = Z_OK;
  const std::string reason = gzerror(file_.get(), &code);
  // The end of a compressed file that is cut is reported as Z_BUF_ERROR.
  if (code != Z_OK && code != Z_STREAM_END)
    throw BadInput("cannot read " + path_.string() + ": " + reason);
  return done;
}

}  // namespace esvr::samples
