// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include <atomic>
#include <csignal>
#include <exception>
#include <iostream>

namespace cuboid_mapping {
namespace {

std::atomic<int> signal_received{0};
static_assert(std::atomic<int>::is_always_lock_free, "needed by a handler of signals");

void rememberSignal(int signal_number) { signal_received = signal_number; }

}  // namespace

void catchInterrupts() {
  std::signal(SIGINT, rememberSignal);
  std::signal(SIGTERM, rememberSignal);
}

void throwIfInterrupted() {
  if (const int signal_number = signal_received) throw Interrupted{signal_number};
}

int runProgram(const std::string& name, const std::function<int()>& body) {
  try {
    return body();
  } catch (const Interrupted& interrupted) {
    std::cerr << name << ": interrupted" << std::endl;
    return 128 + interrupted.signal_number;
  } catch (const std::exception& error) {
    std::cerr << name << ": " << error.what() << std::endl;
    return 1;
  }
}

int runMain(const std::string& name, int argc, char** argv, int (*run)(int, char**)) {
  catchInterrupts();
  return runProgram(name, [&] { return run(argc, argv); });
}

std::optional<int> parseCommandLine(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& outcome) {
    return app.exit(outcome) == 0 ? 0 : 1;
  }
}

}  // namespace cuboid_mapping
