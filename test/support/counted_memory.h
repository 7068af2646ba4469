// SPDX-License-Identifier: BSD-3-Clause
// Counts calls of operator new. To be included by one source of a program.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

namespace cuboid_mapping::test {

/// Bytes of all blocks of this program that are allocated; each has its size in front of it.
inline std::size_t allocated_bytes = 0;
/// Bytes of all blocks that were allocated so far.
inline std::size_t requested_bytes = 0;
constexpr std::size_t kBlockHeader = alignof(std::max_align_t);

}  // namespace cuboid_mapping::test

void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  using namespace cuboid_mapping::test;
  auto* header = static_cast<std::byte*>(std::malloc(size + kBlockHeader));
  if (header == nullptr) return nullptr;
  new (header) std::size_t(size);
  allocated_bytes += size;
  requested_bytes += size;
  return header + kBlockHeader;
}

void* operator new(std::size_t size) {
  void* block = operator new(size, std::nothrow);
  if (block == nullptr) throw std::bad_alloc();
  return block;
}

void operator delete(void* block) noexcept {
  if (block == nullptr) return;
  auto* header = static_cast<std::byte*>(block) - cuboid_mapping::test::kBlockHeader;
  cuboid_mapping::test::allocated_bytes -= *reinterpret_cast<std::size_t*>(header);
  std::free(header);
}

void operator delete(void* block, std::size_t /*size*/) noexcept { operator delete(block); }

// The operators of the standard library call the ones above, those of a sanitizer do not.
void* operator new[](std::size_t size) { return operator new(size); }
void operator delete[](void* block) noexcept { operator delete(block); }
void operator delete[](void* block, std::size_t /*size*/) noexcept { operator delete(block); }
