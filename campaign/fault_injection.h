// SPDX-License-Identifier: BSD-3-Clause
// Calls of the system that fail on demand, of everything in the program that they are linked into.
#pragma once

#include <cstddef>
#include <string>

namespace cuboid_mapping::campaign {

/// What can be made to fail.
enum class FaultKind {
  kMemory,  ///< malloc and its relatives, which operator new calls: no memory.
  kThread,  ///< pthread_create(): too many threads.
  kOpen,    ///< open(): no permission.
  kWrite,   ///< write() and writev(): the disk is full.
  kSync,    ///< fsync(): the disk is broken.
  kRename,  ///< rename(): the disk is broken.
};

const char* toString(FaultKind kind);

/// Whether calls fail one time, or from then on.
enum class FaultDuration { kOnce, kLasting };

/// Makes the n-th call of a kind fail, in any thread, from its construction to its end. One at a
/// time. The calls of the program itself count, too: let no more than the work to be tried lie in
/// its life.
class FaultScope {
 public:
  /// @param number  From 0 on.
  FaultScope(FaultKind kind, std::size_t number, FaultDuration duration);
  ~FaultScope();
  FaultScope(const FaultScope&) = delete;
  FaultScope& operator=(const FaultScope&) = delete;

  /// Whether so many calls were made that one has failed.
  [[nodiscard]] bool hasFailed() const;
  [[nodiscard]] std::size_t numCalls() const;
};

/// The functions of this package that were under way in the last call that failed, the innermost
/// first; empty when there was none.
std::string describeFailedCall();

/// False where a sanitizer has its own malloc: kMemory cannot be asked for then.
bool canFailMemory();

}  // namespace cuboid_mapping::campaign
