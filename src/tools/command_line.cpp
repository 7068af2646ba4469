// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include <csignal>
#include <exception>
#include <iostream>

namespace cuboid_mapping {
namespace {

volatile std::sig_atomic_t signal_received = 0;

void rememberSignal(int signal_number) { signal_received = signal_number; }

}  // namespace

void catchInterrupts() {
  std::signal(SIGINT, rememberSignal);
  std::signal(SIGTERM, rememberSignal);
}

void throwIfInterrupted() {
  if (signal_received != 0) throw Interrupted{signal_received};
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

std::optional<int> parseCommandLine(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& outcome) {
    return app.exit(outcome) == 0 ? 0 : 1;
  }
}

}  // namespace cuboid_mapping
