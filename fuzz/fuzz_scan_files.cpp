// SPDX-License-Identifier: BSD-3-Clause
// Data sets of scans with a damaged poses.txt. PCL reads points; its reader of .pcd files crashes on
// damaged ones.
#include "data_sets/scan_dataset.h"

#include "fuzz_target.h"

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace {

constexpr const char* kScan =
    "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n";

/// A folder that is removed with the program.
class Folder {
 public:
  Folder()
      : path_(std::filesystem::temp_directory_path() / ("fuzz_scans_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_ / "scans");
    for (const char* scan : {"scans/0000.pcd", "scans/0001.pcd"}) write(scan, kScan);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  void write(const char* name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
  }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace

FUZZ_TARGET(fuzz_scan_files) {
  static const Folder kFolder;
  kFolder.write("poses.txt", std::string(reinterpret_cast<const char*>(data), size));
  try {
    const auto dataset = cuboid_mapping::openScanDataset(kFolder.path());
    for (std::size_t i = 0; i < dataset->size() && i < 3; ++i) (void)dataset->read(i);
  } catch (const std::runtime_error&) {
    // Refused, as expected.
  }
  return 0;
}
