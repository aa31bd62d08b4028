// Videos, which the program ffmpeg encodes, and programs that read data from their standard input.
#include "programs/video_file.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <system_error>
#include <thread>

#include "esvr/error.h"
#include "programs/pictures.h"
#include "programs/run_main.h"

extern char** environ;

namespace esvr::report {

// Programs.

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& what, int error) {
  throw RuntimeFailure(what + ": " + std::generic_category().message(error));
}

int checked(int result, const char* what) {
  if (result < 0) fail(what, errno);
  return result;
}

void require(int error, const std::string& what) {
  if (error != 0) fail(what, error);
}

class SpawnActions {
 public:
  SpawnActions() { require(posix_spawn_file_actions_init(&actions_), "posix_spawn"); }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;

  void copy(int from, int to) {
    require(posix_spawn_file_actions_adddup2(&actions_, from, to), "posix_spawn");
  }
  void discard(int descriptor) {
    require(posix_spawn_file_actions_addopen(&actions_, descriptor, "/dev/null", O_WRONLY, 0),
            "posix_spawn");
  }
  [[nodiscard]] const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

/// Attributes that put the program into a process group of its own.
class OwnGroup {
 public:
  OwnGroup() {
    require(posix_spawnattr_init(&attributes_), "posix_spawn");
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes_, 0);
  }
  ~OwnGroup() { posix_spawnattr_destroy(&attributes_); }
  OwnGroup(const OwnGroup&) = delete;
  OwnGroup& operator=(const OwnGroup&) = delete;
  [[nodiscard]] const posix_spawnattr_t* get() const { return &attributes_; }

 private:
  posix_spawnattr_t attributes_{};
};

bool isProgram(const fs::path& path) {
  std::error_code missing;
  return fs::is_regular_file(path, missing) && ::access(path.c_str(), X_OK) == 0;
}

std::string howItEnded(int status) {
  return WIFEXITED(status) ? "it ended with code " + std::to_string(WEXITSTATUS(status))
                           : "it was ended by signal " + std::to_string(WTERMSIG(status));
}

}  // namespace

std::optional<fs::path> findProgram(const std::string& name) {
  const char* folders = std::getenv("PATH");
  std::string rest = folders == nullptr ? "" : folders;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    const fs::path candidate = fs::path(rest.substr(0, end)) / name;
    if (isProgram(candidate)) return candidate;
    rest.erase(0, end + 1);
  }
  return std::nullopt;
}

void Descriptor::close() {
  if (number_ >= 0) ::close(number_);
  number_ = -1;
}

void Descriptor::take(int number) {
  close();
  number_ = number;
}

SocketPair::SocketPair() {
  std::array<int, 2> ends{};
  checked(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), "socketpair");
  ours.take(ends[0]);
  theirs.take(ends[1]);
}

ChildProgram::ChildProgram(const fs::path& program, const std::vector<std::string>& arguments,
                           const CancelToken& cancel)
    : cancel_(cancel), messages_(checked(::memfd_create("messages", MFD_CLOEXEC), "memfd_create")) {
  start(program, arguments);
  input_.theirs.close();
}

void ChildProgram::start(const fs::path& program, std::vector<std::string> words) {
  SpawnActions actions;
  actions.copy(input_.theirs.get(), STDIN_FILENO);
  actions.discard(STDOUT_FILENO);
  actions.copy(messages_.get(), STDERR_FILENO);
  const OwnGroup attributes;
  std::string name = program.string();
  std::vector<char*> argv{name.data()};
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  require(::posix_spawn(&id_, name.c_str(), actions.get(), attributes.get(), argv.data(), environ),
          "cannot run " + name);
}

ChildProgram::~ChildProgram() {
  if (id_ == 0) return;
  ::kill(id_, SIGKILL);
  while (::waitpid(id_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void ChildProgram::waitUntilWritable() const {
  constexpr int kPatience = 100;  // milliseconds between two looks at the token
  if (cancel_.cancelled()) throw Cancelled();
  pollfd waited{input_.ours.get(), POLLOUT, 0};
  ::poll(&waited, 1, kPatience);
}

bool ChildProgram::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n =
        ::send(input_.ours.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n >= 0)
      bytes = bytes.subspan(std::size_t(n));
    else if (errno == EAGAIN || errno == EINTR)
      waitUntilWritable();
    else
      return false;
  }
  return true;
}

std::optional<std::string> ChildProgram::finish() {
  constexpr std::chrono::milliseconds kPatience(2);  // a pause between two looks at the token
  input_.ours.close();
  int status = 0;
  while (::waitpid(id_, &status, WNOHANG) == 0) {
    if (cancel_.cancelled()) throw Cancelled();
    std::this_thread::sleep_for(kPatience);
  }
  id_ = 0;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return std::nullopt;
  const std::string message = lastMessage();
  return message.empty() ? howItEnded(status) : message;
}

std::string ChildProgram::lastMessage() const {
  constexpr off_t kLongest = 2000;  // bytes of a line that are shown
  const off_t size = ::lseek(messages_.get(), 0, SEEK_END);
  std::string text(std::size_t(std::min(size, kLongest)), '\0');
  const ssize_t n = ::pread(messages_.get(), text.data(), text.size(), size - off_t(text.size()));
  text.resize(std::size_t(std::max<ssize_t>(n, 0)));
  text.erase(text.find_last_not_of(" \r\n") + 1);
  return text.substr(text.find_last_of("\r\n") + 1);
}

// Videos.

namespace {

constexpr const char* kWebm = ".webm";
constexpr const char* kMp4 = ".mp4";

using Words = std::vector<std::string>;

/// The codecs are those that browsers play. The numbers after -crf stand for a quality at which
/// errors are hardly visible.
Words codecOf(const fs::path& path) {
  if (path.extension() == kWebm)
    return {"-c:v", "libvpx-vp9", "-crf", "24",      "-b:v", "0",  "-deadline",
            "good", "-cpu-used",  "2",    "-row-mt", "1",    "-f", "webm"};
  return {"-c:v", "libx264", "-crf", "18", "-movflags", "+faststart", "-f", "mp4"};
}

Words inputOf(const VideoForm& form) {
  return {"-f",
          "rawvideo",
          "-pixel_format",
          "rgb24",
          "-video_size",
          std::to_string(form.width) + "x" + std::to_string(form.height),
          "-framerate",
          cli::exactNumber(form.fps),
          "-i",
          "pipe:0"};
}

/// Pixels become the colors of BT.709, as most players assume, and the file says so. Halved
/// resolution of the colors is the form that all players read.
Words colors() {
  return {"-vf",
          "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
          "-colorspace",
          "bt709",
          "-color_primaries",
          "bt709",
          "-color_trc",
          "iec61966-2-1",
          "-color_range",
          "tv"};
}

Words argumentsOf(const VideoForm& form, const fs::path& path, const fs::path& temporary) {
  Words words{"-hide_banner", "-nostdin", "-loglevel", "error", "-y"};
  for (const Words& more :
       {inputOf(form), colors(), codecOf(path),
        Words{"-metadata", "comment=" + form.comment, "file:" + temporary.string()}})
    words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// The colors in front of the background, with three bytes a pixel.
std::vector<std::byte> pixelsOf(const Image& image, const std::array<double, 3>& background) {
  std::vector<std::byte> pixels;
  pixels.reserve(image.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4)
    for (std::size_t c = 0; c < background.size(); ++c) {
      const double behind = (1.0 - double(image.rgba[i + 3])) * background[c];
      pixels.push_back(std::byte(levelOf(double(image.rgba[i + c]) + behind)));
    }
  return pixels;
}

}  // namespace

bool isVideo(const fs::path& path) { return path.extension() == kMp4 || path.extension() == kWebm; }

fs::path findFfmpeg() {
  const auto found = findProgram("ffmpeg");
  if (!found)
    throw UsageError(
        "a video needs the program ffmpeg, which is not in PATH; install it "
        "(apt-get install ffmpeg), or write pictures");
  return *found;
}

void checkVideoSize(int width, int height) {
  if (width % 2 != 0 || height % 2 != 0)
    throw UsageError("a video needs an even width and an even height, not " +
                     std::to_string(width) + " x " + std::to_string(height));
}

VideoFile::VideoFile(fs::path path, const VideoForm& form, const CancelToken& cancel)
    : path_(std::move(path)),
      background_(form.background),
      file_(path_, form.overwrite),
      ffmpeg_(findFfmpeg(), argumentsOf(form, path_, file_.path()), cancel) {}

void VideoFile::add(const Image& image) {
  if (!ffmpeg_.write(pixelsOf(image, background_))) {
    checkEnd();
    fail("it ended before it had read all pictures");
  }
}

void VideoFile::finish() {
  checkEnd();
  if (fs::file_size(file_.path()) == 0) fail("it wrote nothing");
  file_.commit();
}

void VideoFile::checkEnd() {
  if (const auto why = ffmpeg_.finish()) fail(*why);
}

void VideoFile::fail(const std::string& why) const {
  throw RuntimeFailure("cannot write " + path_.string() + ": ffmpeg: " + why);
}

}  // namespace esvr::report
