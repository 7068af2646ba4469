// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include "cuboid_mapping/io/text.h"

#include <boost/lexical_cast/try_lexical_convert.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <exception>
#include <iomanip>
#include <iostream>
#include <new>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

std::atomic<int> signal_received{0};
static_assert(std::atomic<int>::is_always_lock_free, "needed by a handler of signals");

void rememberSignal(int signal_number) { signal_received = signal_number; }

namespace po = boost::program_options;

/// Three numbers; boost's multitoken() would take all following ones, and no negative one.
class PointValue : public po::typed_value<std::vector<double>> {
 public:
  using typed_value::typed_value;
  [[nodiscard]] std::string name() const override { return "x y z"; }
  [[nodiscard]] unsigned int min_tokens() const override { return 3; }
  [[nodiscard]] unsigned int max_tokens() const override { return 3; }
};

/// Text of a limit or a default; empty for a value that means none.
std::string inWords(double number) { return std::abs(number) < 1e9 ? toText(number, 10) : ""; }

/// Text of a range; empty if everything is allowed.
std::string describe(const Range& range) {
  const std::string min = inWords(range.min);
  const std::string max = inWords(range.max);
  if (min.empty()) return max.empty() ? "" : "at most " + max;
  return max.empty() ? "at least " + min : "from " + min + " to " + max;
}

/// The help of an option, with accepted values and default, if there are any.
std::string explain(const std::string& help, const std::string& accepted,
                    const std::string& default_text) {
  std::string more = accepted;
  if (!default_text.empty()) more += (more.empty() ? "" : "; ") + ("default " + default_text);
  return more.empty() ? help : help + " (" + more + ")";
}

[[noreturn]] void refuse(const std::string& name, const std::string& text,
                         const std::string& wanted) {
  throw std::runtime_error("--" + name + ' ' + text + ": must be " + wanted);
}

template <class T>
T toNumber(const std::string& name, const std::string& text, const Range& range) {
  T number{};
  if (!boost::conversion::try_lexical_convert(text, number) ||
      std::isnan(static_cast<double>(number))) {
    refuse(name, text, std::is_integral<T>::value ? "a whole number" : "a number");
  }
  // lexical_cast wraps a negative number around.
  if (std::is_unsigned<T>::value && text[0] == '-') refuse(name, text, "at least 0");
  const auto value = static_cast<double>(number);
  if (!(value >= range.min && value <= range.max)) refuse(name, text, describe(range));
  return number;
}

void checkChoice(const std::string& name, const std::string& text, const Choices& choices) {
  if (std::find(choices.begin(), choices.end(), text) != choices.end()) return;
  refuse(name, text, "one of " + join(choices, ", "));
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream in(text + ',');
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

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
    const int status = body();
    if (!std::cout.flush()) throw std::runtime_error("cannot write the output: is the disk full?");
    return status;
  } catch (const Interrupted& interrupted) {
    std::cerr << name << ": interrupted" << std::endl;
    return 128 + interrupted.signal_number;
  } catch (const std::bad_alloc&) {
    std::cerr << name
              << ": out of memory: choose a coarser resolution, or less of the data at a time"
              << std::endl;
    return 1;
  } catch (const std::exception& error) {
    std::cerr << name << ": " << error.what() << std::endl;
    return 1;
  }
}

int runMain(const std::string& name, int argc, char** argv, int (*run)(int, char**)) {
  catchInterrupts();
  return runProgram(name, [&] { return run(argc, argv); });
}

CommandLine::CommandLine(std::string program, std::string about)
    : program_(std::move(program)), about_(std::move(about)) {
  options_.add_options()("help,h", "print this text");
}

void CommandLine::add(const std::string& name, const po::value_semantic* value,
                      const std::string& help) {
  options_.add_options()(name.c_str(), value, help.c_str());
}

void CommandLine::addFlag(const std::string& name, bool& value, const std::string& help) {
  add(name, po::bool_switch(&value), help);
}

void CommandLine::addVersion(const std::string& version) {
  version_ = version;
  options_.add_options()("version", "print the commit of the sources");
}

template <class T>
void CommandLine::addNumber(const std::string& name, T& value, const std::string& help,
                            Range range) {
  const auto take = [=, &value](const std::string& text) {
    value = toNumber<T>(name, text, range);
  };
  const auto number = static_cast<double>(value);
  const bool is_default = number >= range.min && number <= range.max;  // Else the option is off.
  add(name, po::value<std::string>()->notifier(take)->value_name("number"),
      explain(help, describe(range), is_default ? inWords(number) : ""));
}

template void CommandLine::addNumber(const std::string&, int&, const std::string&, Range);
template void CommandLine::addNumber(const std::string&, unsigned&, const std::string&, Range);
template void CommandLine::addNumber(const std::string&, std::size_t&, const std::string&, Range);
template void CommandLine::addNumber(const std::string&, double&, const std::string&, Range);

template <class T>
void CommandLine::addList(const std::string& name, std::vector<T>& values, const std::string& help,
                          Range range) {
  std::vector<std::string> defaults;
  defaults.reserve(values.size());
  for (const T value : values) defaults.push_back(inWords(static_cast<double>(value)));
  const auto take = [=, &values](const std::string& text) {
    values.clear();
    for (const auto& part : split(text)) values.push_back(toNumber<T>(name, part, range));
  };
  add(name, po::value<std::string>()->notifier(take)->value_name("number,..."),
      explain(help, describe(range), join(defaults, ",")));
}

template void CommandLine::addList(const std::string&, std::vector<int>&, const std::string&,
                                   Range);
template void CommandLine::addList(const std::string&, std::vector<double>&, const std::string&,
                                   Range);

void CommandLine::addList(const std::string& name, std::vector<std::string>& values,
                          const std::string& help, const Choices& choices) {
  const auto take = [=, &values](const std::string& given) {
    values = split(given);
    for (const std::string& text : values) checkChoice(name, text, choices);
  };
  add(name, po::value<std::string>()->notifier(take)->value_name("text,..."),
      explain(help, join(choices, ", "), join(values, ",")));
}

void CommandLine::addPoint(const std::string& name, std::vector<double>& xyz,
                           const std::string& help) {
  add(name, new PointValue(&xyz), help);
}

void CommandLine::addText(const std::string& name, std::string& value, const std::string& help,
                          const Choices& choices) {
  const auto take = [=, &value](const std::string& text) {
    if (!choices.empty()) checkChoice(name, text, choices);
    value = text;
  };
  add(name, po::value<std::string>()->notifier(take)->value_name("text"),
      explain(help, join(choices, ", "), value));
}

void CommandLine::addTexts(const std::string& name, std::vector<std::string>& values,
                           const std::string& help) {
  add(name, po::value(&values)->multitoken()->composing()->value_name("text..."), help);
}

std::optional<int> CommandLine::parse(int argc, char** argv) {
  std::vector<std::string> unexpected;
  po::options_description all;
  all.add(arguments_).add(options_).add_options()("unexpected", po::value(&unexpected));
  po::positional_options_description positions = positions_;
  const bool takes_all = positions.max_total_count() == std::numeric_limits<unsigned>::max();
  if (!takes_all) positions.add("unexpected", -1);
  constexpr int kStyle =
      po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
  try {
    po::variables_map given;
    po::store(
        po::command_line_parser(argc, argv).options(all).positional(positions).style(kStyle).run(),
        given);
    if (given.count("help") > 0) {
      printHelp();
      return 0;
    }
    if (given.count("version") > 0) {
      std::cout << version_ << std::endl;
      return 0;
    }
    po::notify(given);
    if (!unexpected.empty()) throw std::runtime_error("unexpected argument " + unexpected[0]);
    return std::nullopt;
  } catch (const po::required_option& missing) {
    return fail(missing.get_option_name().substr(2) + " is missing");
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}

int CommandLine::fail(const std::string& error) const {
  std::cerr << program_ << ": " << error << "\nAll options: " << program_ << " --help" << std::endl;
  return 1;
}

void CommandLine::printHelp() const {
  std::cout << "Usage: " << program_ << " [OPTION]...";
  for (const auto& argument : arguments_.options()) std::cout << ' ' << argument->long_name();
  std::cout << "\n\n" << about_ << '\n';
  if (!arguments_.options().empty()) std::cout << "\nArguments:\n";
  for (const auto& argument : arguments_.options()) {
    std::cout << "  " << std::left << std::setw(22) << argument->long_name()
              << argument->description() << '\n';
  }
  std::cout << '\n' << options_ << std::flush;
}

}  // namespace cuboid_mapping
