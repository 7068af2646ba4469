// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <boost/program_options.hpp>

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace cuboid_mapping {

/// Thrown by throwIfInterrupted(). Not a std::exception, so that handlers of errors do not catch it.
struct Interrupted {
  int signal_number;
};

/// Makes SIGINT (Ctrl-C) and SIGTERM end the program by throwIfInterrupted(), so that destructors can clean up.
void catchInterrupts();

/// To be called in long loops, in any thread. @throws Interrupted  after one of these signals.
void throwIfInterrupted();

/// Runs the body of a command-line program.
///
/// @param name  Prefix of messages.
/// @return The exit status: that of the body; 1 with the message on stderr after an exception, or if stdout could not
///         be written; 128 plus the signal number, as in shells, after Interrupted.
[[nodiscard]] int runProgram(const std::string& name, const std::function<int()>& body);

/// The main() of a program that Ctrl-C ends cleanly: catchInterrupts() and runProgram().
/// @param run  Gets argc and argv.
[[nodiscard]] int runMain(const std::string& name, int argc, char** argv, int (*run)(int, char**));

/// Numbers that an option accepts, both ends included.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

/// Texts that an option accepts.
using Choices = std::vector<std::string>;

/// The arguments and options of a program, and its --help. Variables hold the defaults, and are set
/// by parse(). Names of options: "rate" for --rate, "output,o" for --output and -o.
class CommandLine {
 public:
  /// @param about  Purpose of the program, for --help.
  CommandLine(std::string program, std::string about);

  /// Adds a required argument without a name.
  /// @param value  A text, or a vector that takes all remaining arguments.
  template <class T>
  void addArgument(const std::string& name, T& value, const std::string& help) {
    arguments_.add_options()(name.c_str(), boost::program_options::value(&value)->required(),
                             help.c_str());
    positions_.add(name.c_str(), std::is_same<T, std::string>::value ? 1 : -1);
  }

  void addFlag(const std::string& name, bool& value, const std::string& help);

  /// Adds the option --version, which prints this and ends the program, as --help does.
  void addVersion(const std::string& version);

  /// Adds an option for int, unsigned int, std::size_t or double.
  template <class T>
  void addNumber(const std::string& name, T& value, const std::string& help, Range range = {});

  /// Adds an option for numbers separated by commas; for int and double.
  template <class T>
  void addList(const std::string& name, std::vector<T>& values, const std::string& help,
               Range range);

  /// Adds an option for texts separated by commas.
  void addList(const std::string& name, std::vector<std::string>& values, const std::string& help,
               const Choices& choices);

  /// Adds an option for three numbers.
  void addPoint(const std::string& name, std::vector<double>& xyz, const std::string& help);

  /// Adds an option for a text. @param choices  Empty: every text is accepted.
  void addText(const std::string& name, std::string& value, const std::string& help,
               const Choices& choices = {});

  /// Adds an option for texts, which may be given several times, with one or more texts each time.
  void addTexts(const std::string& name, std::vector<std::string>& values, const std::string& help);

  /// Sets the variables.
  ///
  /// @return Nothing if the program should go on; else its exit status: 0 after --help, and 1 after
  ///         an error; either has been printed.
  [[nodiscard]] std::optional<int> parse(int argc, char** argv);

 private:
  void add(const std::string& name, const boost::program_options::value_semantic* value,
           const std::string& help);
  void printHelp() const;
  [[nodiscard]] int fail(const std::string& error) const;

  std::string program_;
  std::string about_;
  std::string version_;
  boost::program_options::options_description arguments_{"Arguments", 100};
  boost::program_options::options_description options_{"Options", 100};
  boost::program_options::positional_options_description positions_;
};

}  // namespace cuboid_mapping
