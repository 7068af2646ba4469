// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>

namespace cuboid_mapping {

/// Hears how far long work has come: `done` of `total` steps, from 0 to all of them, total > 0.
///
/// One call at a time, if from several threads. To have the work given up it throws; the caller of
/// the work gets what it has thrown. An empty one is never called.
using ProgressListener = std::function<void(std::uint64_t done, std::uint64_t total)>;

}  // namespace cuboid_mapping
