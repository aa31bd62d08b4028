#include "cli/output.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <system_error>
#include <utility>

#include "core/atomic_file.h"
#include "core/publish_file.h"
#include "core/read_input.h"
#include "esvr/error.h"

namespace esvr::cli {
namespace {

namespace fs = std::filesystem;

/// The files of a run, by their names after all links and, if they exist, by their inodes.
class NotedFiles {
 public:
  /// \return a file that was noted before and is the same one; null: there is none
  const fs::path* find(const fs::path& file) const {
    const auto name = names_.find(followLinks(fs::absolute(file)));
    if (name != names_.end()) return &name->second;
    const auto stamp = stampOf(file);
    const auto inode = stamp ? inodes_.find({stamp->device, stamp->inode}) : inodes_.end();
    return inode == inodes_.end() ? nullptr : &inode->second;
  }

  void note(const fs::path& file) {
    names_.emplace(followLinks(fs::absolute(file)), file);
    if (const auto stamp = stampOf(file))
      inodes_.emplace(std::pair(stamp->device, stamp->inode), file);
  }

 private:
  std::map<fs::path, fs::path> names_;
  std::map<std::pair<std::uint64_t, std::uint64_t>, fs::path> inodes_;
};

bool isFile(const fs::path& path) {
  std::error_code missing;
  const auto type = fs::status(path, missing).type();
  return !path.empty() && path != "-" &&
         (type == fs::file_type::regular || type == fs::file_type::not_found);
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

void requireSeparate(const std::vector<fs::path>& inputs, const std::vector<fs::path>& outputs) {
  NotedFiles noted;
  for (const fs::path& input : inputs)
    if (isFile(input)) noted.note(input);
  for (const fs::path& output : outputs) {
    if (!isFile(output)) continue;
    if (const fs::path* other = noted.find(output))
      throw UsageError(other->string() + " and " + output.string() +
                       " are one file; an output needs a name of its own");
    noted.note(output);
  }
}

}  // namespace esvr::cli
