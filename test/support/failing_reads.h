// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sqlite3.h>
#include <sys/types.h>

#include <cerrno>
#include <initializer_list>

namespace cuboid_mapping::test {

/// While it lives, SQLite can read no file, as from a disk that has gone.
class FailingReads {
 public:
  FailingReads() { set(reinterpret_cast<sqlite3_syscall_ptr>(&fail)); }
  ~FailingReads() { set(nullptr); }
  FailingReads(const FailingReads&) = delete;
  FailingReads& operator=(const FailingReads&) = delete;

 private:
  static ssize_t fail(int /*file*/, void* /*bytes*/, std::size_t /*count*/, off_t /*offset*/) {
    errno = EIO;
    return -1;
  }
  static void set(sqlite3_syscall_ptr function) {
    sqlite3_vfs* system = sqlite3_vfs_find(nullptr);
    for (const char* name : {"pread", "pread64"}) system->xSetSystemCall(system, name, function);
  }
};

}  // namespace cuboid_mapping::test
