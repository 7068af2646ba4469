// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sqlite3.h>
#include <sys/types.h>
#include <unistd.h>

#include <functional>
#include <utility>

namespace cuboid_mapping::test {

/// While it lives, SQLite calls a function before it reads or writes a file. One at a time.
class WatchedDisk {
 public:
  explicit WatchedDisk(std::function<void()> watcher) {
    on_call = std::move(watcher);
    set(reinterpret_cast<sqlite3_syscall_ptr>(&read),
        reinterpret_cast<sqlite3_syscall_ptr>(&write));
  }
  ~WatchedDisk() { set(nullptr, nullptr); }
  WatchedDisk(const WatchedDisk&) = delete;
  WatchedDisk& operator=(const WatchedDisk&) = delete;

 private:
  static ssize_t read(int file, void* bytes, std::size_t count, off_t offset) {
    on_call();
    return ::pread(file, bytes, count, offset);
  }
  static ssize_t write(int file, const void* bytes, std::size_t count, off_t offset) {
    on_call();
    return ::pwrite(file, bytes, count, offset);
  }
  static void set(sqlite3_syscall_ptr read, sqlite3_syscall_ptr write) {
    sqlite3_vfs* system = sqlite3_vfs_find(nullptr);
    for (const char* name : {"pread", "pread64"}) system->xSetSystemCall(system, name, read);
    for (const char* name : {"pwrite", "pwrite64"}) system->xSetSystemCall(system, name, write);
  }

  static inline std::function<void()> on_call;
};

}  // namespace cuboid_mapping::test
