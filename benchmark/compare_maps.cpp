// SPDX-License-Identifier: BSD-3-Clause
// Times the map beside OctoMap and OpenVDB: same process, same clouds, and how far they agree.
#include "command_line.h"
#include "comparison.h"
#include "dataset.h"
#include "report.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

/// A text file that is there when it is complete, or not at all. Opened before the work begins, so
/// that a wrong name is found early.
class ResultFile {
 public:
  explicit ResultFile(const std::string& name)
      : name_(name), partial_name_(name + ".partial"), out_(partial_name_) {
    if (!out_) throwError();
  }
  ~ResultFile() { std::remove(partial_name_.c_str()); }
  ResultFile(const ResultFile&) = delete;
  ResultFile& operator=(const ResultFile&) = delete;

  void write(const std::string& text) {
    out_ << text;
    out_.close();
    if (!out_ || std::rename(partial_name_.c_str(), name_.c_str()) != 0) throwError();
  }

 private:
  [[noreturn]] void throwError() const {
    throw std::runtime_error("cannot write " + name_ + ": " + std::strerror(errno));
  }

  std::string name_;
  std::string partial_name_;
  std::ofstream out_;
};

int run(int argc, char** argv) {
  Options options;
  if (const auto status = parseOptions(argc, argv, options)) return *status;
  std::optional<ResultFile> json;
  if (!options.json_file.empty()) json.emplace(options.json_file);
  const std::vector<Scan> scans = readScans(
      {options.dataset, options.cloud_topic, options.map_frame, options.clouds, options.laps});
  const Comparison comparison = compareMaps(options, scans);
  printReport(options, scans, comparison);
  if (json) json->write(makeJsonReport(options, scans, comparison));
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  cuboid_mapping::catchInterrupts();
  return cuboid_mapping::runProgram("compare_maps",
                                    [&] { return cuboid_mapping::bench::run(argc, argv); });
}
