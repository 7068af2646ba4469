// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/file_replacement.h"

#include "support/as_nobody.h"
#include "support/full_disk.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

namespace cuboid_mapping {
namespace {

using test::AsNobody;
using test::TemporaryFolder;

/// Error text of a failing write; fails if there is no error.
std::string errorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const MapFileError& error) {
    EXPECT_EQ(error.defect(), MapFileDefect::kInaccessible);
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

TEST(FileReplacement, replacesAFileAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  replaceFile(file, "old");
  replaceFile(file, std::string("new\0er", 6));
  EXPECT_EQ(readFile(file), std::string("new\0er", 6));
  EXPECT_EQ(folder.list(), std::vector<std::string>{"map.cuboids"});
}

TEST(FileReplacement, givesAFileAnotherVersion) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  EXPECT_FALSE(versionOf(file));
  replaceFile(file, "old");
  const auto old = versionOf(file);
  ASSERT_TRUE(old);
  (void)readFile(file);
  EXPECT_EQ(versionOf(file), old);
  const auto fail = [](const std::string& /*partial*/) { throw std::bad_alloc(); };
  EXPECT_THROW(replaceFile(file, fail), std::bad_alloc);
  EXPECT_EQ(versionOf(file), old);
  replaceFile(file, "newer");
  EXPECT_FALSE(versionOf(file) == old);
}

TEST(FileReplacement, leavesTheOldFileWhenWritingFails) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  replaceFile(file, "old");
  EXPECT_THROW(replaceFile(file,
                           [](const std::string& partial) {
                             std::ofstream(partial) << "half";
                             throw std::runtime_error("no more");
                           }),
               std::runtime_error);
  EXPECT_EQ(readFile(file), "old");
  EXPECT_EQ(folder.list().size(), 1U);
}

TEST(FileReplacement, saysWhyItCannotWrite) {
  const TemporaryFolder folder;
  EXPECT_NE(errorOf([&] { replaceFile(folder / "no/map", "x"); }).find("No such file"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { replaceFile(folder / ".", "x"); }).find("Is a directory"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { replaceFile("", "x"); }).find("''"), std::string::npos);
  EXPECT_NE(errorOf([&] { replaceFile("/proc/map", "x"); }).find("/proc/map"), std::string::npos);
  EXPECT_TRUE(folder.list().empty());
}

TEST(FileReplacement, writesTheTargetOfALink) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "there");
  std::filesystem::create_symlink("there/latest", folder / "latest.cuboids");
  std::filesystem::create_symlink(folder / "there/map.cuboids", folder / "there/latest");
  for (const std::string content : {"first", "second"}) {  // The target is new, and then replaced.
    checkReplaceable(folder / "latest.cuboids");
    replaceFile(folder / "latest.cuboids", content);
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "latest.cuboids"));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "there/latest"));
    EXPECT_FALSE(std::filesystem::is_symlink(folder / "there/map.cuboids"));
    EXPECT_EQ(readFile(folder / "there/map.cuboids"), content);
  }
  EXPECT_EQ(folder.list().size(), 2U) << "there, latest.cuboids";
  std::filesystem::create_symlink("a", folder / "b");
  std::filesystem::create_symlink("b", folder / "a");
  EXPECT_NE(errorOf([&] { replaceFile(folder / "a", "x"); }).find("symbolic links"),
            std::string::npos);
}

TEST(FileReplacement, leavesAloneWhatALinkInThePlaceOfItsTemporaryFileNames) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  for (const bool is_symbolic : {true, false}) {
    replaceFile(folder / "other", "other");
    is_symbolic ? std::filesystem::create_symlink("other", file + ".partial")
                : std::filesystem::create_hard_link(folder / "other", file + ".partial");
    if (is_symbolic) checkReplaceable(file);
    replaceFile(file, "map");
    EXPECT_EQ(readFile(folder / "other"), "other");
    EXPECT_EQ(readFile(file), "map");
    EXPECT_FALSE(std::filesystem::is_symlink(file));
    EXPECT_EQ(folder.list().size(), 2U) << "other, map.cuboids";
  }
}

TEST(FileReplacement, saysThatAnotherOneIsWritingTheFile) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  replaceFile(file, [&](const std::string& partial) {
    std::ofstream(partial) << "first";
    EXPECT_NE(errorOf([&] { replaceFile(file, "second"); }).find("is writing it"),
              std::string::npos);
    EXPECT_NE(errorOf([&] { checkReplaceable(file); }).find("is writing it"), std::string::npos);
  });
  EXPECT_EQ(readFile(file), "first");
  EXPECT_EQ(folder.list().size(), 1U);
}

TEST(FileReplacement, keepsThePermissionsOfTheFile) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  replaceFile(file, "old");
  for (const mode_t mode : {0600U, 0664U}) {
    ASSERT_EQ(chmod(file.c_str(), mode), 0);
    replaceFile(file, [&](const std::string& partial) {
      struct stat status {};
      EXPECT_EQ(stat(partial.c_str(), &status), 0);
      EXPECT_EQ(status.st_mode & 0777, mode) << "nobody else may read it before it is there";
    });
    struct stat status {};
    ASSERT_EQ(stat(file.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777, mode);
  }
}

TEST(FileReplacement, saysThatAFolderIsNotWritable) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  replaceFile(file, "old");
  ASSERT_EQ(chmod((folder / ".").c_str(), 0555), 0);
  {
    const AsNobody nobody;
    EXPECT_NE(errorOf([&] { replaceFile(file, "new"); }).find(file + ": Permission denied"),
              std::string::npos);
  }
  ASSERT_EQ(chmod((folder / ".").c_str(), 0755), 0);
  EXPECT_EQ(readFile(file), "old");
  EXPECT_EQ(folder.list().size(), 1U);
}

TEST(FileReplacement, saysThatTheDiskIsFull) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  replaceFile(file, "old");
  std::string error;
  {
    const test::FullDisk full(2);
    error = errorOf([&] { replaceFile(file, "new"); });
  }
  EXPECT_NE(error.find("File too large"), std::string::npos) << error;
  EXPECT_EQ(readFile(file), "old");
  EXPECT_EQ(folder.list().size(), 1U);
}

TEST(FileReplacement, takesNeitherPipesNorDevices) {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0666), 0);
  for (const std::string& file : {pipe, std::string("/dev/zero")}) {
    const std::string expected = file + ": it is a device or a pipe";
    EXPECT_NE(errorOf([&] { (void)readFile(file); }).find(expected), std::string::npos);
    EXPECT_NE(errorOf([&] { replaceFile(file, "x"); }).find(expected), std::string::npos);
    EXPECT_NE(errorOf([&] { checkReplaceable(file); }).find(expected), std::string::npos);
  }
  EXPECT_EQ(folder.list().size(), 1U);
  const std::string map = folder / "map.cuboids";
  ASSERT_EQ(mkfifo((map + ".partial").c_str(), 0666), 0);
  replaceFile(map, "x");
  EXPECT_EQ(readFile(map), "x") << "nor waits for somebody to read the partial file";
}

TEST(FileReplacement, promisesItsOwnErrorsForWhateverIsWrongWithAPath) {
  const TemporaryFolder folder;
  const std::string closed = folder / "closed";
  ASSERT_EQ(mkdir(closed.c_str(), 0), 0);
  ASSERT_EQ(symlink("loop", (folder / "loop").c_str()), 0);
  const AsNobody nobody;
  for (const std::string& file :
       {closed + "/map", std::string(5000, 'x'), folder / "loop/map", folder / "loop"}) {
    EXPECT_FALSE(errorOf([&] { (void)readFile(file); }).empty());
    EXPECT_FALSE(errorOf([&] { replaceFile(file, "x"); }).empty());
    EXPECT_FALSE(errorOf([&] { checkReplaceable(file); }).empty());
  }
}

TEST(FileReplacement, refusesANameThatTheSystemWouldCutOffAtAZeroByte) {
  const TemporaryFolder folder;
  const std::string other = folder / "other";
  replaceFile(other, "old");
  const std::string file = other + std::string(1, '\0') + "/map.cuboids";
  EXPECT_NE(errorOf([&] { replaceFile(file, "new"); }).find("zero byte"), std::string::npos);
  EXPECT_NE(errorOf([&] { checkReplaceable(file); }).find("zero byte"), std::string::npos);
  EXPECT_NE(errorOf([&] { (void)readFile(file); }).find("zero byte"), std::string::npos);
  EXPECT_NE(errorOf([&] { requireFile(file); }).find("zero byte"), std::string::npos);
  EXPECT_EQ(readFile(other), "old");
}

TEST(FileReplacement, readsNoMoreThanAllowed) {
  const TemporaryFolder folder;
  const std::string file = folder / "map.cuboids";
  replaceFile(file, "12345");
  EXPECT_EQ(readFile(file, 5), "12345");
  try {
    (void)readFile(file, 4);
    FAIL();
  } catch (const MapFileError& error) {
    EXPECT_EQ(error.defect(), MapFileDefect::kTooBig);
  }
}

TEST(FileReplacement, saysWhyItCannotRead) {
  const TemporaryFolder folder;
  EXPECT_NE(errorOf([&] { (void)readFile(folder / "no"); }).find("No such file"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { (void)readFile(folder / "."); }).find("Is a directory"),
            std::string::npos);
}

}  // namespace
}  // namespace cuboid_mapping
