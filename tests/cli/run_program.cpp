#include "cli/run_program.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <thread>

extern char** environ;

namespace esvr::test {
namespace {

namespace fs = std::filesystem;

class SpawnActions {
 public:
  SpawnActions() { posix_spawn_file_actions_init(&actions_); }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;

  void open(int descriptor, const std::string& path, int flags) {
    constexpr mode_t kMode = 0600;
    posix_spawn_file_actions_addopen(&actions_, descriptor, path.c_str(), flags, kMode);
  }
  [[nodiscard]] const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

int exitCodeOf(int status) {
  constexpr int kSignalBase = 128;
  return WIFEXITED(status) ? WEXITSTATUS(status) : kSignalBase + WTERMSIG(status);
}

/// A program that runs, and the files of its output.
class Process {
 public:
  Process(const fs::path& program, const std::vector<std::string>& arguments)
      : out_(folder_ / "out"), err_(folder_ / "err") {
    SpawnActions actions;
    actions.open(STDIN_FILENO, "/dev/null", O_RDONLY);
    actions.open(STDOUT_FILENO, out_, O_WRONLY | O_CREAT);
    actions.open(STDERR_FILENO, err_, O_WRONLY | O_CREAT);
    std::string name = program.string();
    std::vector<std::string> words = arguments;
    std::vector<char*> argv{name.data()};
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const int error = posix_spawn(&id_, name.c_str(), actions.get(), nullptr, argv.data(), environ);
    if (error != 0) throw std::runtime_error(name + ": " + std::generic_category().message(error));
  }

  [[nodiscard]] bool runs() const {
    siginfo_t info{};
    return ::waitid(P_PID, id_t(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
  }
  [[nodiscard]] std::string err() const { return readText(err_); }
  void interrupt() const { ::kill(id_, SIGINT); }

  /// True if the program has a handler for SIGINT (proc(5), SigCgt).
  [[nodiscard]] bool handlesInterrupts() const {
    std::ifstream status("/proc/" + std::to_string(id_) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("SigCgt:"))
        return (std::stoull(line.substr(line.find('\t')), nullptr, 16) >> (SIGINT - 1)) & 1u;
    return false;
  }

  ProgramRun wait() {
    int status = 0;
    ::waitpid(id_, &status, 0);
    return {exitCodeOf(status), readText(out_), err()};
  }

 private:
  TemporaryFolder folder_;
  std::string out_, err_;
  pid_t id_ = 0;
};

}  // namespace

ProgramRun runProgram(const fs::path& program, const std::vector<std::string>& arguments) {
  return Process(program, arguments).wait();
}

ProgramRun runInterrupted(const fs::path& program, const std::vector<std::string>& arguments,
                          const std::string& sign) {
  Process process(program, arguments);
  const auto ready = [&] {
    return process.handlesInterrupts() && process.err().find(sign) != std::string::npos;
  };
  while (process.runs() && !ready()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  process.interrupt();
  return process.wait();
}

void writeText(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string readText(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace esvr::test
