// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <unistd.h>

namespace cuboid_mapping::test {

/// Drops the rights of root while it lives, so that permissions of files hold.
class AsNobody {
 public:
  AsNobody() { EXPECT_EQ(is_root_ ? seteuid(65534) : 0, 0); }
  ~AsNobody() { EXPECT_EQ(is_root_ ? seteuid(0) : 0, 0); }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;

 private:
  bool is_root_ = geteuid() == 0;
};

}  // namespace cuboid_mapping::test
