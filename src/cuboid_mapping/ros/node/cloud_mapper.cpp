// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/cloud_mapper.h"

#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>

#include <cstddef>
#include <exception>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

CloudMapper::CloudMapper(const NodeParameters& parameters, CloudReceiver& receiver,
                         CloudLedger& ledger, GuardedMap& map, NodeFeatures& features,
                         PublishingThread& publishing, CallbackGuard& guard,
                         const std::atomic<bool>& is_stopping)
    : receiver_(receiver),
      ledger_(ledger),
      map_(map),
      features_(features),
      publishing_(publishing),
      guard_(guard),
      is_stopping_(is_stopping),
      sources_(makeSources(parameters, &is_stopping)) {}

void CloudMapper::start() {
  thread_ = std::thread([this] { mapClouds(); });
}

void CloudMapper::setParameters(const NodeParameters& parameters) {
  const auto lock = hold();
  auto sources = makeSources(parameters, &is_stopping_);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    sources[i]->input.goOnFrom(sources_.at(i)->input);
  }
  sources_ = std::move(sources);
  receiver_.setParameters(parameters);
}

void CloudMapper::mapClouds() {
  for (bool goes_on = true; goes_on;) {
    const bool is_done = guard_.run("clouds", [&] { goes_on = mapNextCloud(); });
    if (!is_done) ros::WallDuration(0.01).sleep();
  }
}

bool CloudMapper::mapNextCloud() {
  if (!receiver_.waitReady()) return false;
  // Taken here: a cloud that waits for this lock would have the poses that the parameters before a change ask for.
  const auto lock = hold();
  if (const auto cloud = receiver_.takeNext()) onCloudInTurn(*cloud);
  return true;
}

void CloudMapper::onCloudInTurn(const PosedCloud& cloud) {
  const std::size_t source = cloud.message.source;
  if (is_paused_.load()) return drop(source, DropReason::kPaused);
  const ros::Time& stamp = cloud.message.header().stamp;
  if (!stamp.isZero() && stamp.toNSec() < first_stamp_ns_) {
    return drop(source, DropReason::kBeforeJump);
  }
  try {
    integrate(cloud);
  } catch (const std::exception& exception) {
    ledger_.noteDropped(source, DropReason::kInternalError, exception.what());
  } catch (...) {
    drop(source, DropReason::kInternalError);
  }
}

void CloudMapper::integrate(const PosedCloud& posed) {
  const SensorMessage& cloud = posed.message;
  const CloudPoses& poses = posed.poses;
  Stopwatch whole;
  Source& source = *sources_.at(cloud.source);
  Observed observed = source.input.compute(cloud, poses);
  for (const std::string& warning : source.input.takeWarnings()) {
    ROS_WARN_STREAM_NAMED(kNodeName, receiver_.sourceName(cloud.source) << ": " << warning);
  }
  if (observed.error) {
    return ledger_.noteDropped(cloud.source, observed.error->defect, observed.error->text);
  }
  Stopwatch stopwatch;
  const ros::Time& stamp = cloud.header().stamp;
  const ScanUpdate& mapped =
      features_.filter(*observed.update, {source.input.scans(), stamp, poses.window_center_map});
  map_.integrate(stamp, mapped, source.input.sensorModel(), poses.window_center_map,
                 source.input.takeKept(cloud, poses));
  observed.figures.apply_ms = stopwatch.lap();
  ledger_.noteInserted(cloud.source, observed.figures,
                       {1e-3 * whole.lap(), steadySeconds() - posed.arrival_s});
  // The cloud is in the map: later failures do not count against it.
  guard_.run("after a cloud", [&] { ledger_.giveAdvice(receiver_.hasReady()); });
  features_.noteMapped({cloud.source, stamp, poses.T_map_sensor.translation(),
                        source.parameters.sensor_model, *observed.update, mapped});
  publishing_.publishSoon();
}

void CloudMapper::drop(std::size_t source, DropReason reason) noexcept {
  guard_.run("counting", [&] { ledger_.noteDropped(source, reason, toAdvice(reason)); });
}

}  // namespace cuboid_mapping_ros
