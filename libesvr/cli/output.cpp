#include "cli/output.h"

#include <algorithm>
#include <array>
#include <string>
#include <system_error>

#include "core/atomic_file.h"
#include "core/publish_file.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

namespace fs = std::filesystem;

bool sameFile(const fs::path& a, const fs::path& b) {
  std::error_code ignored;  // files that do not exist cannot be compared by their inodes
  return fs::equivalent(a, b, ignored) ||
         fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored);
}

std::string alternatives(std::initializer_list<std::string_view> extensions) {
  std::string text;
  for (const auto extension : extensions) {
    if (!text.empty()) text += " or ";
    text += extension;
  }
  return text;
}

/// False for files that are written by way of a name or in several steps.
bool canBeWrittenDirectly(std::initializer_list<std::string_view> extensions) {
  constexpr std::array<std::string_view, 5> kNotDirectly{".esvr", ".vdb", ".nvdb", ".mp4", ".webm"};
  return std::find_first_of(extensions.begin(), extensions.end(), kNotDirectly.begin(),
                            kNotDirectly.end()) == extensions.end();
}

}  // namespace

void requireExtension(const fs::path& path, std::initializer_list<std::string_view> extensions) {
  const std::string given = path.extension().string();
  if (std::find(extensions.begin(), extensions.end(), given) == extensions.end())
    throw UsageError("cannot write " + path.string() + ": its name must end in " +
                     alternatives(extensions));
}

void checkOutput(const fs::path& path, std::initializer_list<std::string_view> extensions,
                 bool overwrite) {
  if (isWrittenDirectly(path) && canBeWrittenDirectly(extensions)) return;  // any name will do
  requireExtension(path, extensions);
  std::error_code unreadable;  // AtomicFile reports the reason
  if (!overwrite && fs::exists(path, unreadable))
    throw RuntimeFailure("cannot write " + path.string() +
                         ": it exists already (--force replaces it)");
  AtomicFile probe(path, overwrite);
}

void requireDistinct(const std::vector<fs::path>& files) {
  for (std::size_t i = 0; i < files.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (sameFile(files[i], files[j]))
        throw UsageError(files[j].string() + " and " + files[i].string() + " are one file");
}

}  // namespace esvr::cli
