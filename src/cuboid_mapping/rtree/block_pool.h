// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Memory for items of one size, in blocks that never move, addressed by 32-bit indices. Free items
/// are reused.
class BlockPool {
 public:
  /// @param item_bytes  A multiple of the items' alignment, at least 4.
  explicit BlockPool(std::size_t item_bytes) : item_bytes_(item_bytes) {}

  /// Reserves memory: the next `num_items` calls of allocate() throw nothing. @throws std::bad_alloc
  void reserve(std::size_t num_items);
  /// Frees blocks that have no item in use. @complexity O(blocks).
  void trim() noexcept;

  /// Allocates one item, with any content. @throws std::bad_alloc  beyond the reserved memory.
  [[nodiscard]] std::uint32_t allocate();
  /// Releases an item. @pre It is from allocate(), and has not been released since.
  void release(std::uint32_t index) noexcept;

  /// The bytes of an item, which never move. @pre It is in use.
  [[nodiscard]] std::byte* operator[](std::uint32_t index) const {
    return blocks_[index >> kBlockBits].bytes.get() + (index & (kBlockItems - 1)) * item_bytes_;
  }

  /// Prefetches an item. This function and its callers must
  /// be inline: gcc drops calls of functions that do nothing else.
  [[gnu::always_inline]] void prefetch(std::uint32_t index) const {
    constexpr std::size_t kCacheLine_bytes = 64;
    const std::byte* item = (*this)[index];
    for (std::size_t i = 0; i < item_bytes_; i += kCacheLine_bytes) __builtin_prefetch(item + i);
  }

  /// One beyond the greatest index that an item has, or can have without more memory.
  [[nodiscard]] std::size_t endIndex() const { return blocks_.size() * kBlockItems; }
  /// Number of items in use.
  [[nodiscard]] std::size_t numItems() const { return num_items_; }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  static constexpr unsigned kBlockBits = 4;
  static constexpr std::uint32_t kBlockItems = 1U << kBlockBits;
  static constexpr std::uint8_t kNone = 0xFF;

  struct Block {
    std::unique_ptr<std::byte[]> bytes;  ///< Empty while no item is in use.
    std::uint8_t num_used = 0;
    std::uint8_t num_fresh = 0;       ///< Items at the end that were never in use.
    std::uint8_t first_free = kNone;  ///< First free item; each holds the number of the next.
  };

  void addBlock();

  std::size_t item_bytes_;
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> open_;    ///< Blocks that have memory and a free item.
  std::vector<std::uint32_t> absent_;  ///< Blocks without memory.
  std::size_t num_items_ = 0;
};

}  // namespace cuboid_mapping
