// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace cuboid_mapping::bench {

/// What figures depend on beside the code.
struct Machine {
  std::string cpu;  ///< Model as Linux names it; "unknown" where it does not.
  unsigned cores = 0;
  std::string compiler;
  std::string build_type;
  std::string commit;  ///< Last one that changed the sources, "unknown" without git.
};

[[nodiscard]] Machine describeMachine();

}  // namespace cuboid_mapping::bench
