// SPDX-License-Identifier: Apache-2.0
#include "tests/support/subprocess.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

namespace farfield {
namespace {

/// In the child: becomes the program.
[[noreturn]] void execute(const std::vector<std::string>& arguments, int out, int err) {
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  std::vector<char*> words;
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  execv(words[0], words.data());
  _exit(127);
}

/// Reads both pipes until both are closed; calls `tick` a few hundred times per second meanwhile.
void drain(int out, int err, ProcessOutput& output, const std::function<void()>& tick) {
  std::array<pollfd, 2> pipes = {pollfd{out, POLLIN, 0}, pollfd{err, POLLIN, 0}};
  std::array<std::string*, 2> texts = {&output.out, &output.err};
  int open_pipes = 2;
  while (open_pipes > 0) {
    poll(pipes.data(), pipes.size(), 3);
    tick();
    for (size_t i = 0; i < pipes.size(); ++i) {
      if (pipes[i].fd < 0 || pipes[i].revents == 0) continue;
      std::array<char, 4096> buffer;
      const ssize_t bytes = read(pipes[i].fd, buffer.data(), buffer.size());
      if (bytes > 0) {
        texts[i]->append(buffer.data(), static_cast<size_t>(bytes));
      } else {
        close(pipes[i].fd);
        pipes[i].fd = -1;  // poll ignores it
        --open_pipes;
      }
    }
  }
}

}  // namespace

ProcessOutput run_process(const std::vector<std::string>& arguments, const std::function<bool()>& interrupt_when) {
  std::array<int, 2> out, err;
  if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(err.data(), O_CLOEXEC) != 0) return {};
  const pid_t child = fork();
  if (child == 0) execute(arguments, out[1], err[1]);
  close(out[1]);
  close(err[1]);
  bool is_interrupted = false;
  const auto tick = [&] {
    if (is_interrupted || !interrupt_when || !interrupt_when()) return;
    kill(child, SIGINT);  // the child is not waited for yet, so the id is still its own
    is_interrupted = true;
  };
  ProcessOutput output;
  drain(out[0], err[0], output, tick);
  int status = 0;
  waitpid(child, &status, 0);
  output.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return output;
}

}  // namespace farfield
