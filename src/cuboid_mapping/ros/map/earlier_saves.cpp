// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/earlier_saves.h"

#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/ros/map/map_storage.h"

#include <filesystem>

namespace cuboid_mapping_ros {
namespace {

namespace fs = std::filesystem;

/// Gives a file a second name, or copies it if the file system has no hard links.
void link(const std::string& file, const std::string& name) {
  const std::string partial = name + ".partial";
  std::error_code error;
  fs::remove(partial, error);
  fs::create_hard_link(file, partial, error);
  if (error) fs::copy_file(file, partial);
  fs::rename(partial, name);
  fs::remove(partial, error);  // rename() leaves it if both names mean one file.
}

/// Copies a store, which is changed in place; links other files.
void copyMap(const std::string& file, const std::string& name) {
  if (isSqliteFile(file)) {
    MapStore(file, StoreAccess::kWrite).copyTo(name);
  } else {
    link(file, name);
  }
}

/// Applies work to the files of a map and of its locks.
template <typename WorkT>
void withLocks(const std::string& from, const std::string& to, const WorkT& work) {
  work(from, to);
  std::error_code ignored;
  if (fs::exists(locksFile(from), ignored)) {
    work(locksFile(from), locksFile(to));
  } else {
    fs::remove(locksFile(to), ignored);
  }
}

}  // namespace

std::string earlierSave(const std::string& map_file, int number) {
  const fs::path path = map_file;
  fs::path name = path.parent_path() / path.stem();
  name += "." + std::to_string(number) + path.extension().string();
  return name.string();
}

void keepEarlierSaves(const std::string& map_file, int count) {
  if (count == 0 || !hasMap(map_file)) return;
  std::error_code ignored;
  int last = 1;  // Fills a gap first, which an interrupted move has left.
  while (last < count && fs::exists(earlierSave(map_file, last), ignored)) ++last;
  const auto move = [](const std::string& from, const std::string& to) { fs::rename(from, to); };
  for (int number = last; number > 1; --number) {
    withLocks(earlierSave(map_file, number - 1), earlierSave(map_file, number), move);
  }
  withLocks(map_file, earlierSave(map_file, 1),
            [](const std::string& from, const std::string& to) { copyMap(followLinks(from), to); });
}

}  // namespace cuboid_mapping_ros
