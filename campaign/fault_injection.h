// SPDX-License-Identifier: BSD-3-Clause
// System calls that fail on demand, in the whole program that links them.
#pragma once

#include <cstddef>
#include <string>

namespace cuboid_mapping::campaign {

/// Calls that can fail.
enum class FaultKind {
  kMemory,  ///< malloc and its relatives, which operator new calls: no memory.
  kThread,  ///< pthread_create(): too many threads.
  kOpen,    ///< open(): no permission.
  kWrite,   ///< write() and writev(): the disk is full.
  kSync,    ///< fsync(): the disk is broken.
  kRename,  ///< rename(): the disk is broken.
};

const char* toString(FaultKind kind);

/// Whether one call fails, or all from then on.
enum class FaultDuration { kOnce, kLasting };

/// Makes the n-th call of a kind fail, in any thread, from its construction to its destruction. One at a
/// time. Calls of the program itself count, too: do nothing but the tested work during
/// its life.
class FaultScope {
 public:
  /// @param number  From 0 on.
  FaultScope(FaultKind kind, std::size_t number, FaultDuration duration);
  ~FaultScope();
  FaultScope(const FaultScope&) = delete;
  FaultScope& operator=(const FaultScope&) = delete;

  /// Whether the failing call was reached.
  [[nodiscard]] bool hasFailed() const;
  [[nodiscard]] std::size_t numCalls() const;
};

/// Functions of this package in the stack of the last failed call, the innermost
/// first; empty if there was none.
std::string describeFailedCall();

/// False if a sanitizer has its own malloc: kMemory cannot be used then.
bool canFailMemory();

}  // namespace cuboid_mapping::campaign
