// SPDX-License-Identifier: BSD-3-Clause
#include "failing_allocation.h"

#include <cstdlib>
#include <new>

namespace {

/// Allocations of this thread before one fails; negative: none fails.
thread_local long allocations_left = -1;

void* allocate(std::size_t size) {
  if (allocations_left >= 0 && allocations_left-- == 0) throw std::bad_alloc();
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

namespace cuboid_mapping::test {

FailingAllocation::FailingAllocation(long number) { allocations_left = number; }
FailingAllocation::~FailingAllocation() { allocations_left = -1; }
bool FailingAllocation::hasFailed() { return allocations_left < 0; }

}  // namespace cuboid_mapping::test

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  try {
    return allocate(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
