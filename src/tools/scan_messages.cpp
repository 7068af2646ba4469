// SPDX-License-Identifier: BSD-3-Clause
#include "scan_messages.h"

#include <filesystem>

namespace cuboid_mapping_ros {

bool ScanFolders::isOne(const std::string& path) {
  namespace fs = std::filesystem;
  return fs::is_directory(path) || fs::path(path).extension() == ".graph";
}

ScanFolders::ScanFolders(const std::vector<std::string>& paths,
                         const cuboid_mapping::BinRow& bin_row) {
  for (const std::string& path : paths) {
    datasets_.push_back(cuboid_mapping::openScanDataset(path, bin_row));
    size_ += datasets_.back()->size();
  }
}

cuboid_mapping::ScanDataset::Item ScanFolders::read(std::size_t number) const {
  auto dataset = datasets_.begin();
  for (; number >= (*dataset)->size(); ++dataset) number -= (*dataset)->size();
  return (*dataset)->read(number);
}

}  // namespace cuboid_mapping_ros
