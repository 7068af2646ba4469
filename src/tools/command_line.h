// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <optional>
#include <string>

namespace cuboid_mapping {

/// Thrown by throwIfInterrupted; no std::exception, so that it passes by handlers of errors.
struct Interrupted {
  int signal_number;
};

/// From now on SIGINT (Ctrl-C) and SIGTERM no longer end the program, but make throwIfInterrupted
/// throw, so that destructors can clean up.
void catchInterrupts();

/// For loops that take long, of any thread. @throws Interrupted after one of these signals.
void throwIfInterrupted();

/// Runs the body of a command-line program.
///
/// @param name  Goes before messages.
/// @return The exit status: that of the body; 1 with the message on stderr after an exception; 128
///         plus the signal number, as shells have it, after Interrupted.
[[nodiscard]] int runProgram(const std::string& name, const std::function<int()>& body);

/// The main() of a program that Ctrl-C ends cleanly: catchInterrupts() and runProgram().
/// @param run  Gets argc and argv.
[[nodiscard]] int runMain(const std::string& name, int argc, char** argv, int (*run)(int, char**));

/// Parses the command line.
///
/// @return Nothing when the program shall go on; else its exit status: 0 after --help, and 1 after
///         an error, either of which has been written out.
[[nodiscard]] std::optional<int> parseCommandLine(CLI::App& app, int argc, char** argv);

}  // namespace cuboid_mapping
