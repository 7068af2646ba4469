// SPDX-License-Identifier: BSD-3-Clause
// Scans of data sets as messages: scans_to_bag writes them to a bag, bag_to_map takes them without one.
#pragma once

#include "cuboid_mapping/io/scan_dataset.h"

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

/// Clouds per second, where nothing else is said: scans have no stamps of their own.
constexpr double kScanRate_hz = 10.0;

/// Data sets of scans, one behind the other.
class ScanFolders {
 public:
  /// Whether a path is one that openScanDataset() may open: a folder, or an OctoMap .graph.
  [[nodiscard]] static bool isOne(const std::string& path);

  /// @throws As openScanDataset().
  explicit ScanFolders(const std::vector<std::string>& paths);

  /// Number of all scans.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// As ScanDataset::read(). @pre number < size().
  [[nodiscard]] cuboid_mapping::ScanDataset::Item read(std::size_t number) const;

 private:
  std::vector<std::unique_ptr<cuboid_mapping::ScanDataset>> datasets_;
  std::size_t size_ = 0;
};

}  // namespace cuboid_mapping_ros
