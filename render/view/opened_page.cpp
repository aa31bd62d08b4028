#include "render/view/opened_page.h"

#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "cli/host_memory.h"
#include "esvr/error.h"
#include "report/child_program.h"

extern char** environ;

namespace esvr::view {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOpener = "xdg-open";

[[noreturn]] void fail(const std::string& what, int error) {
  throw RuntimeFailure(what + ": " + std::generic_category().message(error));
}

fs::path openerPath() {
  const auto path = report::findProgram(kOpener);
  if (!path) throw UsageError(std::string("--open needs the program ") + kOpener);
  return *path;
}

/// Writes a file that only its owner can read. \return its path
fs::path writePrivate(const std::string& text) {
  constexpr std::string_view kSuffix = ".html";
  std::string name = (cli::scratchFolder() / "esvr-view-XXXXXX").string() + std::string(kSuffix);
  report::Descriptor file(::mkstemps(name.data(), int(kSuffix.size())));
  if (file.get() < 0) fail(name, errno);
  if (::write(file.get(), text.data(), text.size()) != ssize_t(text.size())) fail(name, errno);
  return name;
}

/// Starts a program in a session of its own, so that Ctrl-C and the end of this program do not reach
/// the browser.
void start(const fs::path& program, std::string argument) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_RDWR, 0);
  std::string name = program.string();
  std::array<char*, 3> words{name.data(), argument.data(), nullptr};
  pid_t id = 0;
  const int error = posix_spawn(&id, name.c_str(), &actions, &attributes, words.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) fail(name, error);
}

}  // namespace

OpenedPage::OpenedPage(const std::string& url) {
  const fs::path opener = openerPath();
  file_ = writePrivate(
      "<!doctype html>\n<meta charset=\"utf-8\">\n<title>esvr-view</title>\n"
      "<meta name=\"referrer\" content=\"no-referrer\">\n"
      "<meta http-equiv=\"refresh\" content=\"0; url=" +
      url + "\">\n<a href=\"" + url + "\">esvr-view</a>\n");
  start(opener, file_.string());
}

OpenedPage::~OpenedPage() {
  std::error_code ignored;
  fs::remove(file_, ignored);
}

}  // namespace esvr::view
