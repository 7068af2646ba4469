// SPDX-License-Identifier: BSD-3-Clause
// Scans in KITTI's format, and in those of other data sets that are like it.
#pragma once

#include "data_sets/scan_dataset.h"

#include <filesystem>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Opens .bin files with a poses.txt and, perhaps, a calib.txt; see openScanDataset().
[[nodiscard]] std::unique_ptr<ScanDataset> openBinScans(const std::filesystem::path& folder,
                                                        std::vector<std::filesystem::path> files,
                                                        const BinRow& row);

}  // namespace cuboid_mapping
