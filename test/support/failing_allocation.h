// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping::test {

/// While it lives, the allocation of this thread after this number of others fails, once.
class FailingAllocation {
 public:
  explicit FailingAllocation(long number);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;
  [[nodiscard]] static bool hasFailed();
};

}  // namespace cuboid_mapping::test
