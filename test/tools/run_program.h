// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace cuboid_mapping::test {

/// An empty temporary folder, removed by the destructor.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "cuboid_test_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::string operator/(const std::string& name) const { return path_ / name; }

  /// Names of its files.
  [[nodiscard]] std::vector<std::string> list() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }

 private:
  std::filesystem::path path_;
};

inline bool mentions(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline std::string readText(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// End of a program.
struct ProgramEnd {
  int status;  ///< Exit status; -1 if a signal killed it.
  std::string out;
  std::string err;
};

/// Signals that a process handles, as bits; nothing if it has ended.
inline std::optional<std::uint64_t> caughtSignals(pid_t pid) {
  const std::string status = readText("/proc/" + std::to_string(pid) + "/status");
  const std::size_t caught = status.find("SigCgt:");
  if (caught == std::string::npos) return std::nullopt;
  return std::stoull(status.substr(caught + 7), nullptr, 16);
}

/// A program that runs beside the test.
class Program {
 public:
  /// @param arguments  The first one is the program's file.
  /// @param prepare  Called in the new process just before the program.
  explicit Program(std::vector<std::string> arguments, const std::function<void()>& prepare = {}) {
    pid_ = fork();
    if (pid_ != 0) return;
    redirect(STDOUT_FILENO, folder_ / "out");
    redirect(STDERR_FILENO, folder_ / "err");
    if (prepare) prepare();
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    execvp(argv[0], argv.data());
    _exit(127);
  }

  void send(int signal_number) const { kill(pid_, signal_number); }

  /// Waits until it handles a signal, for at most two minutes. @return  Whether it does.
  [[nodiscard]] bool waitUntilItCatches(int signal_number) const {
    for (int i = 0; i < 120000; ++i) {
      const auto signals = caughtSignals(pid_);
      if (!signals) return false;
      if (*signals >> (signal_number - 1) & 1U) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  [[nodiscard]] pid_t pid() const { return pid_; }

  /// Waits for its end.
  ProgramEnd finish() {
    int state = 0;
    waitpid(pid_, &state, 0);
    return {WIFEXITED(state) ? WEXITSTATUS(state) : -1, readText(folder_ / "out"),
            readText(folder_ / "err")};
  }

 private:
  static void redirect(int descriptor, const std::string& file) {
    dup2(open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), descriptor);
  }

  TemporaryFolder folder_;
  pid_t pid_;
};

/// Runs a program to its end.
inline ProgramEnd runProgram(const std::vector<std::string>& arguments,
                             const std::function<void()>& prepare = {}) {
  return Program(arguments, prepare).finish();
}

/// For runProgram: limits the size of files, as on a full disk.
/// @param process  Another process, which ignores SIGXFSZ; 0: this one.
inline void limitFileSize(std::size_t size_bytes, pid_t process = 0) {
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{size_bytes, size_bytes};
  prlimit(process, RLIMIT_FSIZE, &limit, nullptr);
}

/// Waits for a file, for at most half a minute.
inline bool waitForFile(const std::string& file) {
  for (int i = 0; i < 3000 && !std::filesystem::exists(file); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return std::filesystem::exists(file);
}

}  // namespace cuboid_mapping::test
