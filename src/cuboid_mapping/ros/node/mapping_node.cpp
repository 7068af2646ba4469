// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/mapping_node.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/free_memory.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/published_topics.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <ros/console.h>

#include <cstdint>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Number of service calls that run in parallel: four queries, and as many edits.
constexpr std::uint32_t kServiceThreads = 8;

/// Warns of another map in this namespace, such as octomap_server's. Call it before the node publishes: in a nodelet
/// manager, the other map has the same name.
void warnOfOtherMaps(const ros::NodeHandle& nh) {
  for (const char* name : {kOccupiedCuboidsTopic, kOctomapBinaryTopic}) {
    const std::string topic = nh.resolveName(name);
    const std::vector<std::string> others = publishersOf(topic);
    if (others.empty()) continue;
    ROS_WARN_STREAM_NAMED(kNodeName, topic << " comes from " << cuboid_mapping::join(others, ", ")
                                           << ", too: its listeners get two maps. Start one of the "
                                              "nodes in a namespace (__ns:=NAME), or end it");
    return;
  }
}

}  // namespace

MappingNode::MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                         const NodeParameters& parameters,
                         const std::optional<MapSnapshot>& start_map)
    : node_callbacks_(*nh.getCallbackQueue(), guard_, "node"),
      nh_(withQueue(nh, node_callbacks_)),
      private_nh_(withQueue(private_nh, node_callbacks_)),
      service_threads_(guard_, "services", kServiceThreads),
      slow_thread_(guard_, "slow work"),
      publishing_(guard_, [this] { features_.publish(map_); }),
      parameters_(parameters),
      map_(makeMapConfig(parameters)),
      ledger_(parameters),
      receiver_(nh_, parameters, guard_, ledger_),
      map_in_frame_{map_, parameters.frame_id, receiver_.tf(), parameters.service_limits,
                    &is_stopping_},
      host_(makeHost()),
      features_(guard_),
      mapper_(parameters, receiver_, ledger_, map_, features_, publishing_, guard_, is_stopping_),
      diagnostics_(nh_, private_nh_, guard_, ledger_, map_,
                   [this](const CloudLedger::Figures& figures, NodeReport& report) {
                     report.frame_id = withoutSlash(parameters_.frame_id);
                     report.is_paused = mapper_.isPaused();
                     receiver_.report(figures, report);
                     features_.report(report);
                   }) {
  if (start_map) restore(*start_map);
  warnOfOtherMaps(nh_);
  features_.make(host_);
  advertiseServices();
  reconfigure_server_.emplace(host_.services_nh, parameters,
                              [this](const NodeParameters& changed) { reconfigure(changed); });
  receiver_.start();
  startDiagnostics();  // Reads what the receiver has made.
  slow_thread_.start();
  memory_timer_ = Timer(withQueue(nh_, slow_thread_.queue()), kMemoryPeriod_s, giveMemoryBack);
  publishing_.start(nh_, parameters.publish_rate_hz);
  service_threads_.start();  // Calls set the rate of publishing.
  features_.start();
  mapper_.start();
}

/// Stops the threads first: no member may be destroyed while a callback uses it.
MappingNode::~MappingNode() {
  is_stopping_ = true;
  receiver_.stop();
  mapper_.join();
  features_.stop();
  service_threads_.stop();
  publishing_.stop();
  slow_thread_.stop();
}

MapHost MappingNode::makeHost() {
  const auto is_paused = [this] { return mapper_.isPaused(); };
  const auto publish_soon = [this] { publishing_.publishSoon(); };
  const auto note_replaced = [this] {
    const auto lock = mapper_.hold();
    features_.noteReplaced();
  };
  const auto note_received = [this](const std_msgs::Header& header) {
    (void)ledger_.noteReceived(0, header);
  };
  const auto note_mapped = [this](const MappedCloud* cloud) {
    if (cloud == nullptr) return mapper_.drop(0, DropReason::kPaused);
    ledger_.noteInserted(0, {}, {});
    features_.noteMapped(*cloud);
    publishing_.publishSoon();
  };
  return {withQueue(nh_, publishing_.queue()),
          withQueue(private_nh_, publishing_.queue()),
          withQueue(private_nh_, service_threads_.queue()),
          withQueue(nh_, service_threads_.queue()),
          parameters_,
          map_,
          map_in_frame_,
          receiver_.tf(),
          guard_,
          slow_thread_.queue(),
          is_stopping_,
          is_paused,
          publish_soon,
          note_replaced,
          note_received,
          note_mapped};
}

void MappingNode::restore(const MapSnapshot& start_map) {
  map_.edit([&](CuboidMap& map) {
    map_.setProgress([text = start_map.progress] { return text; });
    return restoreSnapshot(start_map, map);
  });
}

void MappingNode::startDiagnostics() {
  receiver_.addStatus(diagnostics_.updater());
  features_.addStatus(diagnostics_.updater());
  diagnostics_.start(nh_);
}

void MappingNode::reconfigure(const NodeParameters& parameters) {
  ledger_.setParameters(parameters);
  mapper_.setParameters(parameters);
  map_.edit([&](CuboidMap& map) { return map.setSensorModel(parameters.source.sensor_model); });
  map_.saveHead();
  post(publishing_.queue(), this, [this, parameters] { features_.setParameters(parameters); });
  publishing_.setRate(parameters.publish_rate_hz);
}

}  // namespace cuboid_mapping_ros
