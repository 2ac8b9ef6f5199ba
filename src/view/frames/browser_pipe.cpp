// SPDX-License-Identifier: BSD-3-Clause
#include "view/frames/browser_pipe.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "dyop/io/file_error.h"

extern char** environ;

namespace dyop::view_internal {
namespace {

constexpr int kLongestWait = 120'000;  // milliseconds for one answer
constexpr int kReads = 3;              // what the browser reads from and writes to
constexpr int kWrites = 4;

// A file descriptor that is closed at the end; -1: none.
struct Descriptor {
  explicit Descriptor(int the_number) : number(the_number) {}
  ~Descriptor() {
    if (number >= 0) close(number);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  const int number;
};

struct SpawnActions {
  SpawnActions() { posix_spawn_file_actions_init(&list); }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&list); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;
  posix_spawn_file_actions_t list;
};

pid_t spawn(const std::vector<std::string>& words, const SpawnActions& actions) {
  std::vector<std::string> own = words;
  std::vector<char*> arguments;
  for (std::string& word : own) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t process = -1;
  const int error =
      posix_spawnp(&process, arguments[0], &actions.list, nullptr, arguments.data(), environ);
  if (error != 0) throw FileError(words[0], std::string("cannot be started: ") + strerror(error));
  return process;
}

std::string from_base64(const std::string& text) {
  std::string bytes;
  std::uint32_t group = 0;
  int bits = 0;
  for (const char c : text) {
    const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char* place = c == '\0' ? nullptr : std::strchr(digits, c);
    if (place == nullptr) break;  // the padding
    group = group << 6 | std::uint32_t(place - digits);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += char(group >> bits & 255u);
  }
  return bytes;
}

}  // namespace

void require_program(const std::string& program, const std::string& package) {
  const char* path = std::getenv("PATH");
  const bool is_named_by_path = program.find('/') != std::string::npos;
  std::istringstream folders(is_named_by_path || path == nullptr ? "" : path);
  bool is_there = is_named_by_path && access(program.c_str(), X_OK) == 0;
  for (std::string folder; !is_there && std::getline(folders, folder, ':');) {
    is_there = access((folder + "/" + program).c_str(), X_OK) == 0;
  }
  if (!is_there) {
    throw FileError(program, "is not installed; on Debian: apt-get install " + package);
  }
}

int run_program(const std::vector<std::string>& words) {
  SpawnActions actions;
  posix_spawn_file_actions_addopen(&actions.list, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  const pid_t process = spawn(words, actions);
  int status = 0;
  waitpid(process, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

BrowserPipe::Process::~Process() {
  if (to >= 0) close(to);  // ends the browser
  if (from >= 0) close(from);
  if (id < 0) return;
  kill(id, SIGTERM);
  int status = 0;
  waitpid(id, &status, 0);
}

void BrowserPipe::start(int width, int height) {
  std::array<int, 2> down{-1, -1};
  std::array<int, 2> up{-1, -1};
  // A socket where this process writes: a pipe would end it with a signal if the browser is gone.
  const bool is_connected = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, down.data()) == 0 &&
                            pipe2(up.data(), O_CLOEXEC) == 0;
  process_.to = down[1];
  process_.from = up[0];
  // The other ends are copied out of the way: they may be numbered 3 or 4 themselves.
  const Descriptor reads(is_connected ? fcntl(down[0], F_DUPFD_CLOEXEC, kWrites + 1) : -1);
  const Descriptor writes(is_connected ? fcntl(up[1], F_DUPFD_CLOEXEC, kWrites + 1) : -1);
  const Descriptor old_reads(down[0]);
  const Descriptor old_writes(up[1]);
  if (reads.number < 0 || writes.number < 0) {
    throw FileError(program_, std::string("cannot be connected by pipes: ") + strerror(errno));
  }
  SpawnActions actions;
  posix_spawn_file_actions_adddup2(&actions.list, reads.number, kReads);
  posix_spawn_file_actions_adddup2(&actions.list, writes.number, kWrites);
  posix_spawn_file_actions_addopen(&actions.list, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions.list, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  std::vector<std::string> words{
      program_,
      "--headless",
      "--remote-debugging-pipe",
      "--enable-unsafe-swiftshader",
      "--hide-scrollbars",
      "--no-first-run",
      "--user-data-dir=" + process_.profile.path().string(),
      "--window-size=" + std::to_string(width) + "," + std::to_string(height)};
  if (geteuid() == 0) words.push_back("--no-sandbox");  // it refuses to start for root otherwise
  process_.id = spawn(words, actions);
}

BrowserPipe::BrowserPipe(const std::string& program, int width, int height) : program_(program) {
  start(width, height);
  const nlohmann::json target = ask("Target.createTarget", {{"url", "about:blank"}});
  session_ = ask("Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}})
                 .at("sessionId");
  ask("Emulation.setDeviceMetricsOverride",
      {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

void BrowserPipe::send(const std::string& message) {
  const std::string bytes = message + '\0';
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count =
        ::send(process_.to, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw FileError(program_, "has ended too early");
    sent += std::size_t(count);
  }
}

std::string BrowserPipe::receive() {
  for (;;) {  // ends with the message, the browser, or the wait
    const std::size_t end = read_ahead_.find('\0');
    if (end != std::string::npos) {
      std::string message = read_ahead_.substr(0, end);
      read_ahead_.erase(0, end + 1);
      return message;
    }
    pollfd waiting{process_.from, POLLIN, 0};
    if (poll(&waiting, 1, kLongestWait) == 0) throw FileError(program_, "does not answer");
    std::array<char, 65536> buffer{};
    const ssize_t count = read(process_.from, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw FileError(program_, "has ended too early");
    read_ahead_.append(buffer.data(), std::size_t(count));
  }
}

nlohmann::json BrowserPipe::ask(const std::string& method, nlohmann::json parameters) {
  nlohmann::json message{{"id", ++asked_}, {"method", method}, {"params", std::move(parameters)}};
  if (!session_.empty()) message["sessionId"] = session_;
  send(message.dump());
  for (;;) {  // what is not the answer tells of events
    const nlohmann::json answer = nlohmann::json::parse(receive());
    if (answer.value("id", std::int64_t{0}) != asked_) continue;
    if (answer.contains("error")) {
      throw FileError(program_,
                      method + ": " + answer.at("error").at("message").get<std::string>());
    }
    return answer.at("result");
  }
}

void BrowserPipe::open(const std::string& address) {
  ask("Page.navigate", {{"url", address}});
}

nlohmann::json BrowserPipe::evaluate(const std::string& expression) {
  const nlohmann::json answer =
      ask("Runtime.evaluate",
          {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
  if (answer.contains("exceptionDetails")) {
    throw FileError(program_, "the page fails: " + answer.at("exceptionDetails").dump());
  }
  return answer.at("result").value("value", nlohmann::json());
}

std::string BrowserPipe::picture() {
  return from_base64(ask("Page.captureScreenshot", {{"format", "png"}}).at("data"));
}

ScratchFolder::ScratchFolder(const std::string& use) {
  // mkdtemp() replaces the six letters at the end.
  const std::string pattern = "dyop-" + use + "-" + std::string(6, 'X');
  std::string name = (std::filesystem::temp_directory_path() / pattern).string();
  if (mkdtemp(name.data()) == nullptr) {
    throw FileError(name, std::string("could not be created: ") + std::strerror(errno));
  }
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace dyop::view_internal
