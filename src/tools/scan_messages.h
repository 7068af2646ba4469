// SPDX-License-Identifier: BSD-3-Clause
// Scans of data sets as messages: scans_to_bag writes them to a bag, bag_to_map uses them directly.
#pragma once

#include "data_sets/scan_dataset.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Names in the messages of scans.
struct ScanNames {
  std::string topic = "/cloud";
  std::string map_frame = "map";
  std::string sensor_frame = "sensor";
};

/// Default rate of clouds: scans have no stamps of their own.
constexpr double kScanRate_hz = 10.0;

/// Data sets of scans, one after the other.
class ScanFolders {
 public:
  /// Whether openScanDataset() may open a path: a folder, or an OctoMap .graph.
  [[nodiscard]] static bool isOne(const std::string& path);

  /// @throws As openScanDataset().
  explicit ScanFolders(const std::vector<std::string>& paths,
                       const cuboid_mapping::BinRow& bin_row = {});

  /// Number of scans in all data sets.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// As ScanDataset::read(). @pre number < size().
  [[nodiscard]] cuboid_mapping::ScanDataset::Item read(std::size_t number) const;

 private:
  std::vector<std::unique_ptr<cuboid_mapping::ScanDataset>> datasets_;
  std::size_t size_ = 0;
};

}  // namespace cuboid_mapping_ros
