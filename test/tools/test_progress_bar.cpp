// SPDX-License-Identifier: BSD-3-Clause
#include "progress_bar.h"

#include "command_line.h"

#include <gtest/gtest.h>

#include <csignal>

namespace cuboid_mapping {
namespace {

TEST(FormatProgress, beginsWithoutATime) {
  EXPECT_EQ(formatProgress({0, 26, 0.0}, "clouds"),
            "[..............................]   0 %  0 of 26 clouds");
}

TEST(FormatProgress, saysTheTimeLeft) {
  EXPECT_EQ(formatProgress({10, 40, 20.0}, "clouds"),
            "[#######.......................]  25 %  10 of 40 clouds, 1:00 left");
  EXPECT_EQ(formatProgress({1, 1000, 10.0}, "scans"),
            "[..............................]   0 %  1 of 1000 scans, 2:46:30 left");
}

TEST(FormatProgress, endsWithTheTimeItTook) {
  EXPECT_EQ(formatProgress({7, 7, 65.2}, "clouds"),
            "[##############################] 100 %  7 of 7 clouds in 1:06");
}

TEST(FormatProgress, isNotFullBeforeTheEnd) {
  EXPECT_EQ(formatProgress({999, 1000, 999.0}, "clouds"),
            "[#############################.]  99 %  999 of 1000 clouds, 0:01 left");
}

TEST(ShowProgress, endsTheWorkAfterCtrlC) {
  const auto work = [](int /*argc*/, char** /*argv*/) {
    const ProgressListener listener = showProgress("rows");
    listener(1, 10);
    (void)raise(SIGINT);
    listener(2, 10);
    return 0;
  };
  EXPECT_EXIT(exit(runMain("program", 0, nullptr, work)), testing::ExitedWithCode(128 + SIGINT),
              "program: interrupted");
}

}  // namespace
}  // namespace cuboid_mapping
