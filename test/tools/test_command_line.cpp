// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <new>

namespace cuboid_mapping {
namespace {

/// A program with an option of each kind, and what it printed.
struct Program {
  std::string map;
  std::vector<std::string> others;
  bool is_fast = false;
  int width = 7;
  std::size_t count = std::numeric_limits<std::size_t>::max();
  double rate_hz = 10.0;
  std::vector<double> eye;
  unsigned num_boxes = 0;
  std::vector<int> branchings{2, 4};
  std::string fusion = "brick";
  std::vector<std::string> settings;
  std::string output;
  std::string out;
  std::string err;

  std::optional<int> parse(std::vector<std::string> texts) {
    CommandLine line("program", "Does something.");
    line.addArgument("map", map, "a map");
    line.addArgument("others", others, "more maps");
    line.addFlag("fast", is_fast, "in a hurry");
    line.addVersion("a1b2c3");
    line.addNumber("width", width, "in pixels", {1, 100});
    line.addNumber("count", count, "of clouds", {1});
    line.addNumber("rate", rate_hz, "in Hz");
    line.addNumber("boxes", num_boxes, "none by default", {1, 5});
    line.addPoint("eye", eye, "where to look from");
    line.addList("branching", branchings, "of the tree", Range{2, 64});
    line.addText("fusion", fusion, "the strategy", {"brick", "class"});
    line.addTexts("set", settings, "key=value");
    line.addText("output,o", output, "the file to write");
    texts.insert(texts.begin(), "program");
    std::vector<char*> argv;
    for (std::string& text : texts) argv.push_back(text.data());
    argv.push_back(nullptr);
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const auto status = line.parse(static_cast<int>(texts.size()), argv.data());
    out = testing::internal::GetCapturedStdout();
    err = testing::internal::GetCapturedStderr();
    return status;
  }
};

TEST(CommandLine, keepsDefaultsAndTakesArguments) {
  Program program;
  EXPECT_FALSE(program.parse({"a", "b", "c"})) << program.err;
  EXPECT_EQ(program.map, "a");
  EXPECT_EQ(program.others, (std::vector<std::string>{"b", "c"}));
  EXPECT_FALSE(program.is_fast);
  EXPECT_EQ(program.width, 7);
  EXPECT_EQ(program.branchings, (std::vector<int>{2, 4}));
  EXPECT_EQ(program.fusion, "brick");
  EXPECT_EQ(program.out + program.err, "");
}

TEST(CommandLine, takesOptionsOfAllKinds) {
  Program program;
  EXPECT_FALSE(program.parse({"--fast", "--width", "9",     "--count=3",   "--rate", "-0.5",
                              "--eye",  "1",       "-2",    "-3.5",        "a",      "b",
                              "--set",  "k=1",     "l=-2",  "--branching", "8,16",   "--fusion",
                              "class",  "-o",      "x.bag", "--set",       "m=3"}))
      << program.err;
  EXPECT_TRUE(program.is_fast);
  EXPECT_EQ(program.width, 9);
  EXPECT_EQ(program.count, 3U);
  EXPECT_EQ(program.rate_hz, -0.5);
  EXPECT_EQ(program.eye, (std::vector<double>{1.0, -2.0, -3.5}));
  EXPECT_EQ(program.others, std::vector<std::string>{"b"}) << "--eye takes three numbers only";
  EXPECT_EQ(program.settings, (std::vector<std::string>{"k=1", "l=-2", "m=3"}));
  EXPECT_EQ(program.branchings, (std::vector<int>{8, 16}));
  EXPECT_EQ(program.fusion, "class");
  EXPECT_EQ(program.output, "x.bag");
}

TEST(CommandLine, saysWhatIsWrong) {
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{}, "map is missing"},
      {{"a"}, "others is missing"},
      {{"a", "b", "--slow"}, "'--slow'"},
      {{"a", "b", "--wid", "3"}, "'--wid'"},
      {{"a", "b", "--width"}, "'--width' is missing"},
      {{"a", "b", "--width", "1", "--width", "2"}, "'--width' cannot be specified more than once"},
      {{"a", "b", "--width", "0"}, "--width 0: must be from 1 to 100"},
      {{"a", "b", "--width", "1.5"}, "--width 1.5: must be a whole number"},
      {{"a", "b", "--count", "-2"}, "--count -2: must be at least 0"},
      {{"a", "b", "--count", "0"}, "--count 0: must be at least 1"},
      {{"a", "b", "--rate", "fast"}, "--rate fast: must be a number"},
      {{"a", "b", "--rate", "nan"}, "--rate nan: must be a number"},
      {{"a", "b", "--eye", "1", "2"}, "'--eye' is missing"},
      {{"a", "b", "--eye", "1", "y", "2"}, "'y'"},
      {{"a", "b", "--branching", "2,128"}, "--branching 128: must be from 2 to 64"},
      {{"a", "b", "--branching", "2,,4"}, "--branching : must be a whole number"},
      {{"a", "b", "--fusion", "glue"}, "--fusion glue: must be one of brick, class"}};
  for (const auto& [texts, message] : cases) {
    Program program;
    EXPECT_EQ(program.parse(texts), std::optional<int>(1)) << message;
    EXPECT_EQ(program.err.rfind("program: ", 0), 0U) << program.err;
    EXPECT_NE(program.err.find(message), std::string::npos) << program.err;
    EXPECT_NE(program.err.find("program --help"), std::string::npos) << program.err;
    EXPECT_EQ(program.out, "");
  }
}

TEST(CommandLine, explainsOptionsWithRangesAndDefaults) {
  Program program;
  EXPECT_EQ(program.parse({"--help"}), std::optional<int>(0));
  EXPECT_EQ(program.out.rfind("Usage: program [OPTION]... map others\n\nDoes something.\n", 0), 0U)
      << program.out;
  for (const char* line :
       {"  others                more maps", "  -h [ --help ]",
        "in pixels (from 1 to 100; default 7)", "none by default (from 1 to 5)",
        "of clouds (at least 1)", "in Hz (default 10)", "  --eye x y z",
        "(from 2 to 64; default 2,4)", "the strategy (brick, class; default brick)",
        "  -o [ --output ] text"}) {
    EXPECT_NE(program.out.find(line), std::string::npos) << line << '\n' << program.out;
  }
  EXPECT_EQ(program.parse({"--version"}), std::optional<int>(0)) << "without its arguments";
  EXPECT_EQ(program.out, "a1b2c3\n");
}

TEST(RunProgram, saysWhatToDoWithoutMemory) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(runProgram("program", []() -> int { throw std::bad_alloc(); }), 1);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "program: out of memory: choose a coarser resolution, or less of the data at a time\n");
}

}  // namespace
}  // namespace cuboid_mapping
