#include "cli/run_program.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
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

constexpr const char *kOut = "out", *kErr = "err";

}  // namespace

RunningProgram::RunningProgram(const fs::path& program, const Words& arguments) {
  SpawnActions actions;
  actions.open(STDIN_FILENO, "/dev/null", O_RDONLY);
  actions.open(STDOUT_FILENO, folder_ / kOut, O_WRONLY | O_CREAT);
  actions.open(STDERR_FILENO, folder_ / kErr, O_WRONLY | O_CREAT);
  std::string name = program.string();
  Words words = arguments;
  std::vector<char*> argv{name.data()};
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int error = posix_spawn(&id_, name.c_str(), actions.get(), nullptr, argv.data(), environ);
  if (error != 0) throw std::runtime_error(name + ": " + std::generic_category().message(error));
}

RunningProgram::~RunningProgram() {
  if (id_ == 0) return;
  send(SIGKILL);
  (void)wait();
}

bool RunningProgram::runs() const {
  siginfo_t info{};
  return ::waitid(P_PID, id_t(id_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
}

std::string RunningProgram::out() const { return readText(folder_ / kOut); }
std::string RunningProgram::err() const { return readText(folder_ / kErr); }
void RunningProgram::send(int signal) const { ::kill(id_, signal); }

bool RunningProgram::handlesInterrupts() const {
  std::ifstream status("/proc/" + std::to_string(id_) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("SigCgt:"))
      return (std::stoull(line.substr(line.find('\t')), nullptr, 16) >> (SIGINT - 1)) & 1u;
  return false;
}

ProgramRun RunningProgram::wait() {
  int status = 0;
  ::waitpid(std::exchange(id_, 0), &status, 0);
  return {exitCodeOf(status), out(), err()};
}

ProgramRun runProgram(const fs::path& program, const Words& arguments) {
  return RunningProgram(program, arguments).wait();
}

ProgramRun runInterrupted(const fs::path& program, const Words& arguments,
                          const std::string& sign) {
  RunningProgram process(program, arguments);
  const auto ready = [&] {
    return process.handlesInterrupts() && process.err().find(sign) != std::string::npos;
  };
  while (process.runs() && !ready()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  process.send(SIGINT);
  return process.wait();
}

ProgramRun succeeded(ProgramRun run, const char* file, int line) {
  if (run.exitCode == 0) return run;
  std::ostringstream message;
  message << file << ':' << line << ": a program failed: " << run;
  throw std::runtime_error(message.str());
}

}  // namespace esvr::test
