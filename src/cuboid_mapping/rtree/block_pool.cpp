// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/block_pool.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace cuboid_mapping {

std::uint32_t BlockPool::allocate() {
  const std::uint32_t number = findOpenBlock();
  Block& block = blocks_[number];
  if (block.bytes == nullptr) acquire(block);
  const std::uint32_t index = number << kBlockBits | block.first_free;
  block.first_free = std::to_integer<std::uint8_t>(*(*this)[index]);
  ++block.num_used;
  ++num_items_;
  return index;
}

void BlockPool::release(std::uint32_t index) {
  const std::uint32_t number = index >> kBlockBits;
  Block& block = blocks_[number];
  assert(block.num_used > 0);
  *(*this)[index] = std::byte{block.first_free};
  block.first_free = static_cast<std::uint8_t>(index & (kBlockItems - 1));
  --block.num_used;
  --num_items_;
  if (!block.is_open) {
    block.is_open = true;
    open_blocks_.push_back(number);
  }
  if (block.num_used == 0 && !(keeps_block_ && num_held_blocks_ == 1)) {
    block.bytes.reset();
    --num_held_blocks_;
  }
}

void BlockPool::clear() noexcept {
  const auto held = std::find_if(blocks_.begin(), blocks_.end(),
                                 [](const Block& block) { return block.bytes != nullptr; });
  if (!keeps_block_ || held == blocks_.end()) {
    *this = BlockPool(item_bytes_, keeps_block_);
    return;
  }
  std::swap(blocks_.front(), *held);
  blocks_.resize(1);
  blocks_.front().num_used = 0;
  blocks_.front().is_open = true;
  linkItems(blocks_.front());
  open_blocks_.assign(1, 0);
  num_items_ = 0;
  num_held_blocks_ = 1;
}

std::size_t BlockPool::numBytes() const {
  return num_held_blocks_ * kBlockItems * item_bytes_ + blocks_.capacity() * sizeof(Block) +
         open_blocks_.capacity() * sizeof(std::uint32_t);
}

std::uint32_t BlockPool::findOpenBlock() {
  while (!open_blocks_.empty()) {
    const std::uint32_t number = open_blocks_.back();
    if (blocks_[number].num_used < kBlockItems) return number;
    blocks_[number].is_open = false;
    open_blocks_.pop_back();
  }
  const auto number = static_cast<std::uint32_t>(blocks_.size());
  blocks_.emplace_back();
  blocks_.back().is_open = true;
  open_blocks_.push_back(number);
  return number;
}

void BlockPool::acquire(Block& block) {
  block.bytes = std::make_unique<std::byte[]>(kBlockItems * item_bytes_);
  linkItems(block);
  ++num_held_blocks_;
}

void BlockPool::linkItems(Block& block) {
  block.first_free = 0;
  for (std::uint32_t i = 0; i < kBlockItems; ++i) {
    block.bytes[i * item_bytes_] = static_cast<std::byte>(i + 1);
  }
}

}  // namespace cuboid_mapping
