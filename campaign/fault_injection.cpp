// SPDX-License-Identifier: BSD-3-Clause
#include "fault_injection.h"

#include <cxxabi.h>
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define CUBOID_MAPPING_HAS_OWN_MALLOC
#endif

namespace cuboid_mapping::campaign {
namespace {

constexpr int kMaxFrames = 64;

std::atomic<bool> is_armed{false};
std::atomic<std::size_t> num_calls{0};
std::atomic<std::size_t> num_failures{0};
FaultKind armed_kind = FaultKind::kMemory;
std::size_t armed_number = 0;
FaultDuration armed_duration = FaultDuration::kOnce;
std::array<void*, kMaxFrames> failed_frames;
int num_failed_frames = 0;
thread_local bool is_looking = false;  ///< The stack is being read, which may need memory itself.

/// Counts a call. @return Whether it must fail.
bool isToFail(FaultKind kind) {
  if (!is_armed.load(std::memory_order_acquire) || kind != armed_kind || is_looking) return false;
  const std::size_t call = num_calls++;
  const bool fails =
      armed_duration == FaultDuration::kOnce ? call == armed_number : call >= armed_number;
  if (!fails) return false;
  if (num_failures++ == 0) {
    is_looking = true;
    num_failed_frames = backtrace(failed_frames.data(), kMaxFrames);
    is_looking = false;
  }
  return true;
}

template <typename FunctionT>
FunctionT findNext(const char* name) {
  return reinterpret_cast<FunctionT>(dlsym(RTLD_NEXT, name));
}

/// The name of a function of this package without its arguments; empty for others.
std::string nameOf(void* frame) {
  Dl_info info{};
  if (dladdr(frame, &info) == 0 || info.dli_sname == nullptr) return {};
  int status = 0;
  char* demangled = abi::__cxa_demangle(info.dli_sname, nullptr, nullptr, &status);
  if (demangled == nullptr) return {};
  std::string name = demangled;
  std::free(demangled);
  const bool is_ours = name.find("cuboid_mapping") != std::string::npos &&
                       name.find("campaign") == std::string::npos &&
                       name.compare(0, 5, "std::") != 0 && name.compare(0, 5, "void ") != 0;
  if (!is_ours) return {};
  return name.substr(0, name.find('('));
}

}  // namespace

const char* toString(FaultKind kind) {
  switch (kind) {
    case FaultKind::kMemory: return "memory";
    case FaultKind::kThread: return "thread";
    case FaultKind::kOpen: return "open";
    case FaultKind::kWrite: return "write";
    case FaultKind::kSync: return "fsync";
    case FaultKind::kRename: break;
  }
  return "rename";
}

FaultScope::FaultScope(FaultKind kind, std::size_t number, FaultDuration duration) {
  std::array<void*, 1> frame;
  (void)backtrace(frame.data(), 1);  // Loads a library at the first call.
  num_calls = 0;
  num_failures = 0;
  num_failed_frames = 0;
  armed_kind = kind;
  armed_number = number;
  armed_duration = duration;
  is_armed.store(true, std::memory_order_release);
}

FaultScope::~FaultScope() { is_armed = false; }

bool FaultScope::hasFailed() const { return num_failures > 0; }

std::size_t FaultScope::numCalls() const { return num_calls; }

std::string describeFailedCall() {
  std::string text;
  std::string last;
  for (int i = 0; i < num_failed_frames; ++i) {
    const std::string name = nameOf(failed_frames[static_cast<std::size_t>(i)]);
    if (name.empty() || name == last) continue;
    text += (text.empty() ? "" : " < ") + name;
    last = name;
  }
  return text;
}

bool canFailMemory() {
#ifdef CUBOID_MAPPING_HAS_OWN_MALLOC
  return false;
#else
  return true;
#endif
}

}  // namespace cuboid_mapping::campaign

using cuboid_mapping::campaign::FaultKind;
using cuboid_mapping::campaign::findNext;
using cuboid_mapping::campaign::isToFail;

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
extern "C" {

#ifndef CUBOID_MAPPING_HAS_OWN_MALLOC
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

namespace {
void* failMemory() {
  errno = ENOMEM;
  return nullptr;
}
}  // namespace

void* malloc(std::size_t size) noexcept {
  return isToFail(FaultKind::kMemory) ? failMemory() : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  return isToFail(FaultKind::kMemory) ? failMemory() : __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  return isToFail(FaultKind::kMemory) ? failMemory() : __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  return isToFail(FaultKind::kMemory) ? failMemory() : __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  *block = memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
#endif

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                   void* argument) noexcept {
  if (isToFail(FaultKind::kThread)) return EAGAIN;
  static const auto kNext = findNext<decltype(&pthread_create)>("pthread_create");
  return kNext(thread, attributes, start, argument);
}

int open(const char* file, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  if (isToFail(FaultKind::kOpen)) {
    errno = EACCES;
    return -1;
  }
  static const auto kNext = findNext<int (*)(const char*, int, ...)>("open");
  return kNext(file, flags, mode);
}

ssize_t write(int descriptor, const void* bytes, std::size_t count) {
  if (isToFail(FaultKind::kWrite)) {
    errno = ENOSPC;
    return -1;
  }
  static const auto kNext = findNext<decltype(&write)>("write");
  return kNext(descriptor, bytes, count);
}

ssize_t writev(int descriptor, const struct iovec* parts, int count) {
  if (isToFail(FaultKind::kWrite)) {
    errno = ENOSPC;
    return -1;
  }
  static const auto kNext = findNext<decltype(&writev)>("writev");
  return kNext(descriptor, parts, count);
}

int fsync(int descriptor) {
  if (isToFail(FaultKind::kSync)) {
    errno = EIO;
    return -1;
  }
  static const auto kNext = findNext<decltype(&fsync)>("fsync");
  return kNext(descriptor);
}

int rename(const char* from, const char* to) noexcept {
  if (isToFail(FaultKind::kRename)) {
    errno = EIO;
    return -1;
  }
  static const auto kNext = findNext<decltype(&rename)>("rename");
  return kNext(from, to);
}

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
