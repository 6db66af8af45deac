// SPDX-License-Identifier: Apache-2.0
#include "path_tracer/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "base/file_io.h"
#include "base/result.h"

namespace farfield {

namespace {

constexpr int kPollMilliseconds = 10;  // until a cancel is seen

struct Child {
  pid_t id;
  FileDescriptor output;  // of the child's standard output, for reading
};

Result<Child> start(const std::vector<std::string>& command) {
  std::vector<char*> argv;
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    return make_error(ErrorCode::Io, fmt::format("cannot start {}: {}", argv[0], std::strerror(errno)));
  FileDescriptor output(ends[0]);
  const FileDescriptor input(ends[1]);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input.get(), STDOUT_FILENO);
  pid_t child = 0;
  const int error = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return make_error(ErrorCode::Io, fmt::format("cannot start {}: {}", argv[0], std::strerror(error)));
  return Child{child, std::move(output)};
}

// Text that comes in pieces, handed on line by line.
class LineBuffer {
 public:
  explicit LineBuffer(const std::function<void(std::string_view)>& line) : line_(line) {}

  void add(std::string_view text) {
    for (const char c : text) {
      if (c != '\n') {
        if (pending_.size() < kLongestLine) pending_ += c;
        continue;
      }
      line_(pending_);
      pending_.clear();
    }
  }

 private:
  static constexpr size_t kLongestLine = 4096;
  const std::function<void(std::string_view)>& line_;
  std::string pending_;
};

// Waits for output for a moment. False once there will be none any more.
bool read_some(int descriptor, LineBuffer& lines) {
  pollfd wanted{descriptor, POLLIN, 0};
  if (::poll(&wanted, 1, kPollMilliseconds) <= 0) return true;
  char text[4096];
  const ssize_t count = ::read(descriptor, text, sizeof text);
  if (count > 0) lines.add({text, static_cast<size_t>(count)});
  return count > 0 || (count < 0 && errno == EINTR);
}

// What an ended child has left in the pipe. Its own children might hold the pipe open: no waiting for more.
void read_rest(int descriptor, LineBuffer& lines) {
  pollfd wanted{descriptor, POLLIN, 0};
  while (::poll(&wanted, 1, 0) > 0 && (wanted.revents & POLLIN) != 0 && read_some(descriptor, lines)) {
  }
}

}  // namespace

std::string this_program() {
  std::error_code error;
  // Not "/proc/self/exe" itself, so that the child has this program's name in `ps`.
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "/proc/self/exe" : program.string();
}

std::string how_it_ended(int status) {
  return WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                             : fmt::format("exit code {}", WEXITSTATUS(status));
}

Result<int> run_child(const std::vector<std::string>& command, const Job& job,
                      const std::function<void(std::string_view line)>& line) {
  FARFIELD_TRY_LET(const auto child, start(command));
  LineBuffer lines(line);
  bool is_talking = true, asked_to_stop = false;
  for (;;) {
    if (is_talking)
      is_talking = read_some(child.output.get(), lines);
    else
      ::poll(nullptr, 0, kPollMilliseconds);
    if (!asked_to_stop && job.is_cancelled()) {
      ::kill(child.id, SIGTERM);
      asked_to_stop = true;
    }
    int status = 0;
    const pid_t ended = ::waitpid(child.id, &status, WNOHANG);
    if (ended < 0 && errno != EINTR)
      return make_error(ErrorCode::Io, fmt::format("cannot wait for {}: {}", command[0], std::strerror(errno)));
    if (ended != child.id) continue;
    if (asked_to_stop) return make_error(ErrorCode::Cancelled, "cancelled");
    read_rest(child.output.get(), lines);
    return status;
  }
}

}  // namespace farfield
