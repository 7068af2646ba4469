// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nodelet/nodelet.h>

#include <memory>
#include <thread>

namespace cuboid_mapping_ros {

class MappingNode;
class StartReport;
struct NodeParameters;
struct StartMap;

/// MappingNode as a nodelet.
class MappingNodelet : public nodelet::Nodelet {
 public:
  /// Process in which the nodelet runs.
  enum class Process : unsigned char {
    kShared,  ///< Its manager also loads others, which do not wait for a map file.
    kOwn      ///< It ends with an error if the map file cannot be read.
  };
  explicit MappingNodelet(Process process = Process::kShared);
  /// Waits for a map file that is being read.
  ~MappingNodelet() override;

 private:
  /// An argument is the map_file. @throws std::exception  if the node cannot start, with the reason in the log:
  /// the manager then does not load the nodelet, and its loader ends. In a shared process, a map file is read
  /// afterwards. Topics and services come with the map; until then /diagnostics says so, and for good if that fails.
  void onInit() override;
  void startLater(const NodeParameters& parameters, const StartMap& source);
  void start(NodeParameters parameters, const StartMap& source);

  Process process_;
  std::unique_ptr<StartReport> start_report_;
  std::unique_ptr<MappingNode> node_;
  std::thread starting_;
};

}  // namespace cuboid_mapping_ros
