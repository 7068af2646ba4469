// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/block_pool.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {

void BlockPool::reserve(std::size_t num_items) {
  while ((blocks_.size() - absent_.size()) * kBlockItems - num_items_ < num_items) addBlock();
}

/// Adds a block with memory, whose items are all free.
void BlockPool::addBlock() {
  auto bytes = std::unique_ptr<std::byte[]>(new std::byte[kBlockItems * item_bytes_]);
  if (absent_.empty()) {  // Reserves both lists for every block: no other step needs memory.
    if (blocks_.size() == blocks_.capacity()) {
      const std::size_t capacity = std::max<std::size_t>(8, blocks_.size() * 3 / 2);
      open_.reserve(capacity);
      absent_.reserve(capacity);
      blocks_.reserve(capacity);
    }
    absent_.push_back(static_cast<std::uint32_t>(blocks_.size()));
    blocks_.emplace_back();
  }
  const std::uint32_t number = absent_.back();
  absent_.pop_back();
  blocks_[number] = {std::move(bytes), 0, kBlockItems, kNone};
  open_.insert(open_.begin(), number);  // Blocks in use are filled first.
}

void BlockPool::trim() noexcept {
  const auto end = std::remove_if(open_.begin(), open_.end(), [this](std::uint32_t number) {
    Block& block = blocks_[number];
    if (block.num_used > 0) return false;
    block.bytes.reset();
    absent_.push_back(number);
    return true;
  });
  open_.erase(end, open_.end());
}

std::uint32_t BlockPool::allocate() {
  if (open_.empty()) addBlock();
  const std::uint32_t number = open_.back();
  Block& block = blocks_[number];
  std::uint32_t item = block.first_free;
  if (item == kNone) {
    item = kBlockItems - block.num_fresh--;
  } else {
    block.first_free = std::to_integer<std::uint8_t>(block.bytes[item * item_bytes_]);
  }
  ++num_items_;
  if (++block.num_used == kBlockItems) open_.pop_back();
  return number << kBlockBits | item;
}

void BlockPool::release(std::uint32_t index) noexcept {
  const std::uint32_t number = index >> kBlockBits;
  Block& block = blocks_[number];
  assert(block.num_used > 0);
  if (block.num_used-- == kBlockItems) open_.push_back(number);
  const std::uint32_t item = index & (kBlockItems - 1);
  block.bytes[item * item_bytes_] = std::byte{block.first_free};
  block.first_free = static_cast<std::uint8_t>(item);
  --num_items_;
}

std::size_t BlockPool::numBytes() const {
  return (blocks_.size() - absent_.size()) * kBlockItems * item_bytes_ +
         blocks_.capacity() * sizeof(Block) +
         (open_.capacity() + absent_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace cuboid_mapping
