// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>

namespace cuboid_mapping {

/// Receives the progress of long work: `done` of `total` steps, total > 0; not all work reports 0.
///
/// Several threads may call it, one at a time. An exception that it throws ends the work, and reaches the
/// caller of the work. An empty listener is never called.
using ProgressListener = std::function<void(std::uint64_t done, std::uint64_t total)>;

}  // namespace cuboid_mapping
