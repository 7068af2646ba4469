// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <string>

namespace cuboid_mapping::test {

/// A terminal with a keyboard, for a program that writes stderr to it.
class Terminal {
 public:
  Terminal() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) return;
    // Held open here, too, so that its output can be read after the program's end.
    slave_ = open(ptsname(master_), O_RDWR | O_NOCTTY);
  }
  ~Terminal() {
    if (slave_ >= 0) close(slave_);
    if (master_ >= 0) close(master_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// False on machines without pseudo-terminals.
  [[nodiscard]] bool isThere() const { return slave_ >= 0; }

  /// For Program, just before its start: keys of this terminal now go to the calling process.
  void attach() const {
    setsid();
    ioctl(slave_, TIOCSCTTY, 0);
    dup2(slave_, STDERR_FILENO);
  }

  void pressCtrlC() const {
    constexpr char kKey = '\x03';
    if (write(master_, &kKey, 1) != 1) abort();
  }

  /// Waits until a text is on the screen, for at most two minutes.
  bool waitFor(const std::string& text) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (shown_.find(text) == std::string::npos && std::chrono::steady_clock::now() < end) {
      readMore(100);
    }
    return shown_.find(text) != std::string::npos;
  }

  /// All output so far.
  const std::string& shown() {
    while (readMore(0)) {
    }
    return shown_;
  }

 private:
  bool readMore(int timeout_ms) {
    pollfd waiting{master_, POLLIN, 0};
    if (poll(&waiting, 1, timeout_ms) <= 0) return false;
    char text[4096];
    const ssize_t length = read(master_, text, sizeof(text));
    if (length > 0) shown_.append(text, static_cast<std::size_t>(length));
    return length > 0;
  }

  int master_;
  int slave_ = -1;
  std::string shown_;
};

}  // namespace cuboid_mapping::test
