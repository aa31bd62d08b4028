// The files of a run: inputs, among them those that come through a pipe, and outputs.
#include "programs/files.h"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <system_error>
#include <utility>

#include "core/atomic_file.h"
#include "core/memory_budget.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/grid.h"

namespace esvr::cli {

namespace fs = std::filesystem;

// Names of inputs in messages.

namespace {

struct ShownInput {
  std::string file, name;
};

/// They are never removed: what ends a program is said after its files are gone.
struct ShownInputs {
  std::mutex mutex;
  std::vector<ShownInput> all;
};
ShownInputs& shownInputs() {
  static ShownInputs inputs;
  return inputs;
}

std::string inJson(const std::string& text) {
  const std::string quoted = jsonText(text, -1);
  return quoted.substr(1, quoted.size() - 2);
}

}  // namespace

void showInputAs(const fs::path& file, const std::string& name) {
  const std::lock_guard lock(shownInputs().mutex);
  shownInputs().all.push_back({file.string(), name});
}

std::string withNamesOfInputs(std::string text, bool isJson) {
  const std::lock_guard lock(shownInputs().mutex);
  for (const auto& [file, name] : shownInputs().all) {
    const std::string from = isJson ? inJson(file) : file, to = isJson ? inJson(name) : name;
    for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size())
      text.replace(at, from.size(), to);
  }
  return text;
}

// Input that comes through a pipe.

namespace {

/// The first bytes of the formats, at most kBeginBytes, which decide the extension of the copy.
struct PipedFormat {
  std::string_view begin, extension;
};
constexpr std::array kFormats{PipedFormat{{" BDV\0\0\0\0", 8}, ".vdb"},
                              PipedFormat{"NanoVDB", ".nvdb"},
                              PipedFormat{"\x89"
                                          "ESVR\r\n\n",
                                          ".esvr"},
                              PipedFormat{"ply", ".ply"}};
constexpr std::size_t kBeginBytes = 8;

std::string shownName(const std::string& input) {
  return input == kStandardInput ? "standard input" : input;
}

InputStream openInput(const std::string& input) {
  return input == kStandardInput ? InputStream::standardInput() : InputStream(input);
}

/// Reads until the buffer is full or the stream ends. \return the number of bytes
std::size_t fillBlock(InputStream& stream, std::span<std::byte> buffer) {
  std::size_t done = 0;
  while (done < buffer.size())
    if (const std::size_t n = stream.read(buffer.subspan(done)))
      done += n;
    else
      break;
  return done;
}

std::string_view extensionOf(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kBeginBytes));
  for (const PipedFormat& format : kFormats)
    if (text.starts_with(format.begin)) return format.extension;
  throw BadInput(name + " is neither an OpenVDB nor a NanoVDB nor an .esvr nor a PLY file" +
                 (bytes.empty() ? ": it is empty" : ""));
}

/// A pipe may have no end, and a full disk disturbs other programs.
std::uint64_t mostBytes(const fs::path& folder) {
  struct statvfs disk {};
  if (::statvfs(folder.c_str(), &disk) != 0) failAt("cannot use ", folder, errno);
  return std::uint64_t(disk.f_bavail) * disk.f_frsize / 2;
}

/// A new link in the folder to an open file. Its name says what it is a copy of.
fs::path linkTo(int fd, const fs::path& folder, const std::string& input,
                std::string_view extension) {
  const std::string from = input == kStandardInput ? "standard-input" : "pipe";
  const std::string target = "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(fd);
  std::random_device random;
  for (;;) {
    std::array<char, 9> digits{};
    std::snprintf(digits.data(), digits.size(), "%08x", unsigned(random()));
    const fs::path path =
        folder / ("esvr-" + from + "-" + std::string(digits.data()) + std::string(extension));
    if (::symlink(target.c_str(), path.c_str()) == 0) return path;
    if (errno != EEXIST) failAt("cannot write ", path, errno);
  }
}

}  // namespace

bool isThere(const fs::path& path) {
  std::error_code unreadable;
  return fs::exists(path, unreadable);
}

bool PipedInput::isPipe(const std::string& input) {
  std::error_code missing;
  return input == kStandardInput || fs::is_fifo(input, missing);
}

PipedInput::PipedInput(const std::string& input, const fs::path& folder) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  const std::string name = shownName(input);
  InputStream stream = openInput(input);
  std::vector<std::byte> block(kBlock);
  std::size_t n = fillBlock(stream, block);
  const std::string_view extension = extensionOf(std::span(block).first(n), name);
  const std::uint64_t most = mostBytes(folder);
  fd_ = createNameless(folder);
  if (fd_ < 0) failAt("cannot write a file in ", folder, errno);
  try {
    for (std::uint64_t total = n; n > 0; n = fillBlock(stream, block), total += n) {
      if (total > most)
        throw RuntimeFailure(name + " has more than " + byteText(double(most)) +
                             ", half of the space that " + folder.string() +
                             " has; --scratch names another folder");
      writeAll(fd_, std::span(block).first(n), folder);
    }
    path_ = linkTo(fd_, folder, input, extension);
    showInputAs(path_, name);
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

PipedInput::~PipedInput() {
  ::unlink(path_.c_str());
  ::close(fd_);
}

// The names of outputs.

namespace {

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

// The bytes of outputs.

namespace {

/// Writes to a device or a pipe, which cannot be replaced by a complete file.
void writeDirectly(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) failAt("cannot write ", path, errno);
  try {
    writeAll(fd, bytes, path);
  } catch (...) {
    ::close(fd);
    throw;
  }
  if (::close(fd) != 0) failAt("cannot write ", path, errno);
}

}  // namespace

void writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                bool overwrite) {
  if (isWrittenDirectly(path)) return writeDirectly(path, bytes);
  AtomicFile file(path, overwrite);
  file.write(bytes);
  file.commit();
}

std::string jsonText(const nlohmann::ordered_json& json, int indent) {
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  std::string text = json.dump(indent, ' ', false, kReplace);
  const bool isShown = shownText(text, LineEnds::kKeep) == text;
  return isShown ? text : json.dump(indent, ' ', true, kReplace);
}

void writeJson(const JsonFile& file, const nlohmann::ordered_json& json) {
  constexpr int kIndent = 2;
  const std::string text = withNamesOfInputs(jsonText(json, kIndent), true) + '\n';
  if (file.path == kStandardOutput) {
    std::cout << text;
    return;
  }
  const Completion completion;  // a report tells of an interrupted run, too
  writeBytes(file.path, std::as_bytes(std::span(text)), file.overwrite);
}

}  // namespace esvr::cli
