// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <string>
#include <utility>

namespace cuboid_mapping::campaign {

/// Result of work in its own process; crashes and timeouts are reported.
/// @param work  () -> std::string. @param limit_s  Seconds after which the process is killed.
template <typename WorkT>
std::string runIsolated(const WorkT& work, unsigned limit_s = 60) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  const pid_t child = fork();
  if (child < 0) return "no process";
  if (child == 0) {
    close(ends[0]);
    alarm(limit_s);
    std::string said;
    try {
      said = work();
    } catch (const std::exception& exception) {
      said = std::string("uncaught: ") + exception.what();
    }
    for (std::size_t done = 0; done < said.size();) {
      const ssize_t count = ::write(ends[1], said.data() + done, said.size() - done);
      if (count <= 0) break;
      done += static_cast<std::size_t>(count);
    }
    _exit(0);
  }
  close(ends[1]);
  std::string said;
  char buffer[4096];
  for (ssize_t count = 0; (count = ::read(ends[0], buffer, sizeof(buffer))) > 0;) {
    said.append(buffer, static_cast<std::size_t>(count));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFSIGNALED(status)) return said;
  if (WTERMSIG(status) == SIGALRM) return "no end after " + std::to_string(limit_s) + " s";
  return std::string("crash: ") + strsignal(WTERMSIG(status));
}

}  // namespace cuboid_mapping::campaign
