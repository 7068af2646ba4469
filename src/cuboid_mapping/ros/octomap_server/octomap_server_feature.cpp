// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/octomap_server/octomap_server_feature.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <octomap_msgs/BoundingBoxQuery.h>
#include <octomap_msgs/GetOctomap.h>
#include <ros/console.h>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::toText;
using O = OctomapServerParameters;

/// Minimum time before the log repeats what a topic leaves out.
constexpr double kLogPeriod_s = 30.0;

ChangeSet clearCells(CuboidMap& map, const CellBox& box) {
  std::vector<VoxelBrick> cleared;
  map.voxels().forEachIn(box, [&](const VoxelBrick& brick) {
    cleared.push_back({brick.brick, PackedVoxels(brick.voxels.known(), map.sensorModel().min())});
  });
  return map.replace(box, cleared);
}

octomap_msgs::Octomap toOctree(const MapView& view, OctreeKind kind) {
  double num_left_out = 0.0;
  octomap_msgs::Octomap message = toOctomapMessage(view.map, kind, view.header, num_left_out);
  if (num_left_out > 0.0) {
    ROS_WARN_STREAM_THROTTLE_NAMED(
        kLogPeriod_s, kNodeName,
        "an octree reaches 32768 voxels from the origin: octomap_full and octomap_binary leave out "
            << counted(static_cast<std::uint64_t>(num_left_out), "voxel")
            << " beyond. occupied_cuboids and cuboid_map have all of them");
  }
  return message;
}

void noteLeftOut(const char* topic, double num_voxels) {
  if (num_voxels == 0.0) return;
  ROS_WARN_STREAM_THROTTLE_NAMED(
      kLogPeriod_s, kNodeName,
      topic << " leaves out " << counted(static_cast<std::uint64_t>(num_voxels), "voxel")
            << ", which lie more than 32768 voxels from the middle of the map");
}

}  // namespace

MapView viewWholeMap(const MapInFrame& map, const SnapshotLimits& limits) {
  MapView view;
  view.header.frame_id = withoutSlash(map.frame_id);
  try {
    const auto look = [&](const CuboidMap& /*content*/, const ros::Time& stamp,
                          const MapWindow* window) {
      const std::size_t num_elsewhere = window == nullptr ? 0 : window->figures().num_on_disk_only;
      if (num_elsewhere > 0 && map.limits.outside == QueriesOutside::kRefuse) {
        throw std::runtime_error(
            "not loaded: " + describePages(num_elsewhere) +
            ", would have to be read from the disk, and an octree without them is incomplete. Set "
            "the parameter window/queries to load; the topic of this name shows the map in memory");
      }
      view.header.stamp = stamp;
    };
    const auto end = map.is_stopped == nullptr ? ProgressListener() : endWhen(*map.is_stopped);
    view.map = takeWholeSnapshot(map.map, view.header.frame_id, limits, look, end);
  } catch (const MapFileError& error) {
    throw std::runtime_error(std::string("not loaded: ") + error.what());
  }
  return view;
}

std::string clearBox(const MapInFrame& in_frame, const MetricBox& box_map) {
  GuardedMap& map = in_frame.map;
  // A flat box means the voxels in which it lies, as in octomap_server.
  MetricBox box = box_map;
  const double thinnest_m = 1e-3 * map.grid().resolution();
  box.max_m = box.max_m.cwiseMax(box.min_m + Eigen::Vector3d::Constant(thinnest_m));
  const bool is_ordered = (box_map.min_m.array() <= box_map.max_m.array()).all();
  const auto cells = is_ordered ? map.grid().toCellBox(box) : std::nullopt;
  if (!cells) {
    return "box from " + toText(box_map.min_m) + " to " + toText(box_map.max_m) +
           ": corners must be finite and inside the map's range, and min not above max";
  }
  const PageHold hold = map.hold();
  std::size_t num_pages = 0;
  std::string error = loadPages(in_frame, *cells, num_pages);
  if (!error.empty()) return error;
  const auto turn = map.beginEdit();
  map.editIn(*cells, [&](CuboidMap& content) {
    map.keepForUndo(*cells);
    return clearCells(content, *cells);
  });
  return {};
}

OctomapServerFeature::OctomapServerFeature(const MapHost& host)
    : frame_id_(withoutSlash(host.parameters.frame_id)),
      map_(host.map),
      guard_(host.guard),
      projection_(host.parameters.of<O>()),
      parameters_(host.parameters.of<O>()),
      queue_(host.slow_queue) {
  advertiseTopics(withQueue(host.nh, queue_));
  projection_publisher_.emplace(
      host.nh,
      GridPublisher::Options{kProjectedMapTopic, kProjectedMapUpdatesTopic,
                             host.parameters.keyframe_period_s},
      [this] { return makeProjection(); });
  advertiseServices(host);
}

template <typename MessageT>
void OctomapServerFeature::advertise(const ros::NodeHandle& nh, const char* name,
                                     std::function<MessageT()> make) {
  const auto build = [this, make] {
    ++num_built_;
    return make();
  };
  const auto topic = std::make_shared<LatchedTopic<MessageT>>(
      nh, name, 1, [this, build](const ros::SingleSubscriberPublisher& listener) {
        views_ = {};
        if (hasContent()) listener.publish(build());
        views_ = {};
      });
  topics_.push_back({topic->name(), [topic, build] {
                       if (topic->hasListeners()) topic->publish(build());
                     }});
}

void OctomapServerFeature::advertiseTopics(const ros::NodeHandle& nh) {
  advertise<octomap_msgs::Octomap>(nh, kOctomapBinaryTopic,
                                   [this] { return makeOctomap(OctreeKind::kBinary); });
  advertise<octomap_msgs::Octomap>(nh, kOctomapFullTopic,
                                   [this] { return makeOctomap(OctreeKind::kFull); });
  advertise<visualization_msgs::MarkerArray>(nh, kOccupiedCellsTopic,
                                             [this] { return makeMarkers(ShownCells::kOccupied); });
  advertise<visualization_msgs::MarkerArray>(nh, kFreeCellsTopic,
                                             [this] { return makeMarkers(ShownCells::kFree); });
  advertise<sensor_msgs::PointCloud2>(nh, kPointCloudCentersTopic,
                                      [this] { return makeCenters(); });
}

void OctomapServerFeature::advertiseServices(const MapHost& host) {
  const ros::NodeHandle& nh = host.public_services_nh;
  const auto offer_octree = [&](const char* name, OctreeKind kind) {
    servers_.push_back(offerService<octomap_msgs::GetOctomap>(
        nh, name, [&map = host.map_in_frame, kind](const auto& /*request*/, auto& response) {
          response.map = toOctree(viewWholeMap(map, limitsOfMachine()), kind);
        }));
  };
  offer_octree(kOctomapBinaryTopic, OctreeKind::kBinary);
  offer_octree(kOctomapFullTopic, OctreeKind::kFull);
  servers_.push_back(offerService<octomap_msgs::BoundingBoxQuery>(
      host.services_nh, kClearBoxService,
      [&map = host.map_in_frame](const auto& request, auto& /*response*/) {
        const std::string error = clearBox(map, {toVector(request.min), toVector(request.max)});
        if (!error.empty()) throw std::runtime_error(error);
      }));
}

void OctomapServerFeature::onChanges(const MapChanges& changes) {
  projection_.noteChanges(changes.changed);
  if (!changes.changed.is_everything && changes.changed.bricks.empty()) return;
  is_projection_due_ = has_changed_ = true;
  const std::lock_guard<std::mutex> lock(stamps_mutex_);
  edited_ = changes.stamp == last_cloud_ ? ros::Time::now() : ros::Time();
  last_cloud_ = changes.stamp;
}

ros::Time OctomapServerFeature::stampOf(const ros::Time& cloud) const {
  const std::lock_guard<std::mutex> lock(stamps_mutex_);
  return cloud == last_cloud_ && !edited_.isZero() ? edited_ : cloud;
}

void OctomapServerFeature::setParameters(const NodeParameters& parameters) {
  projection_ = ProjectedMap(parameters.of<O>());
  is_projection_due_ = true;
  post(queue_, this, [this, changed = parameters.of<O>()] {
    parameters_ = changed;
    has_changed_ = true;
  });
}

void OctomapServerFeature::publish() {
  if (!is_posted_.exchange(true)) {
    post(queue_, this, [this] {
      is_posted_ = false;
      publishSlow();
    });
  }
  if (is_projection_due_) {  // A failure does not make everything due.
    is_projection_due_ =
        !guard_.run(kProjectedMapTopic, [this] { projection_publisher_->publish(); });
  }
  projection_publisher_->publishKeyframe();
}

void OctomapServerFeature::publishSlow() {
  const bool has_changed = has_changed_.exchange(false);
  views_ = {};
  for (Topic& topic : topics_) {
    if (has_changed || topic.is_due) {
      topic.is_due = !guard_.run(topic.name, topic.publish);  // The others go on.
    }
  }
  views_ = {};
}

bool OctomapServerFeature::hasContent() const {
  return map_.read([](const CuboidMap& map) { return map.voxels().size() > 0; });
}

const MapView& OctomapServerFeature::look(Speckles speckles) {
  const bool is_filtered = speckles == Speckles::kAsAsked && parameters_.filter_speckles;
  std::optional<MapView>& view = views_.at(is_filtered ? 1 : 0);
  if (view) return *view;
  view = map_.readWhole([&](const CuboidMap& map, const ros::Time& stamp) {
    MapView now;
    now.map = takeSnapshot(map, frame_id_);
    now.header.stamp = stampOf(stamp);
    now.header.frame_id = frame_id_;
    if (is_filtered) removeSpeckles(map.voxels(), now.map.bricks);
    return now;
  });
  return *view;
}

octomap_msgs::Octomap OctomapServerFeature::makeOctomap(OctreeKind kind) {
  return toOctree(look(Speckles::kKept), kind);
}

visualization_msgs::MarkerArray OctomapServerFeature::makeMarkers(ShownCells cells) {
  const MapView& view = look(Speckles::kAsAsked);
  double num_left_out = 0.0;
  auto markers = toCellMarkers(view.map, cells, parameters_, view.header, num_left_out);
  noteLeftOut(cells == ShownCells::kFree ? kFreeCellsTopic : kOccupiedCellsTopic, num_left_out);
  return markers;
}

sensor_msgs::PointCloud2 OctomapServerFeature::makeCenters() {
  const MapView& view = look(Speckles::kAsAsked);
  const ShownLeaves shown =
      computeShownLeaves(view.map, ShownCells::kOccupied, parameters_, OctreeKind::kFull);
  noteLeftOut(kPointCloudCentersTopic, shown.num_left_out);
  return toCenters(shown.leaves, view.map.resolution_m, view.header);
}

nav_msgs::OccupancyGrid OctomapServerFeature::makeProjection() {
  ++num_built_;
  std_msgs::Header header;
  header.frame_id = frame_id_;
  map_.readWhole([&](const CuboidMap& map, const ros::Time& stamp) {
    header.stamp = stampOf(stamp);
    projection_.update(map);
  });
  FarTiles far;
  auto grid = projection_.makeGrid(header, map_.grid().resolution(), far);
  if (far.count > 0) {
    ROS_WARN_STREAM_THROTTLE_NAMED(kLogPeriod_s, kNodeName,
                                   kProjectedMapTopic
                                       << " leaves out " << counted(far.count, "tile")
                                       << " of 8 x 8 cells far from the rest, the farthest at x = "
                                       << far.farthest_m.x() << " m, y = " << far.farthest_m.y()
                                       << " m: with them it would be larger than 100 MB. Stray "
                                          "returns are removed with ~set_box, or kept out with "
                                          "sensor_model/max_range");
  }
  return grid;
}

std::vector<ParameterDeclaration> OctomapServerFeature::declare() {
  return {
      {"occupancy_min_z", "m", adjustable(number(&O::occupancy_min_z_m)),
       "Cells below this height are left out of octomap_server's markers, points and "
       "projected_map.",
       "occupancy_max_z"},
      {"occupancy_max_z", "m", adjustable(number(&O::occupancy_max_z_m)),
       "Cells above this height are left out of octomap_server's markers, points and "
       "projected_map."},
      {"min_x_size", "m", adjustable(number(&O::min_x_size_m, 0.0, 1e4)),
       "Minimum extent of projected_map along x, centred on the origin."},
      {"min_y_size", "m", adjustable(number(&O::min_y_size_m, 0.0, 1e4)),
       "Minimum extent of projected_map along y, centred on the origin."},
      {"filter_speckles", "", adjustable(boolean(&O::filter_speckles)),
       "true: occupied voxels without an occupied neighbour (of 26) are left out of "
       "octomap_server's markers, points and projected_map."},
  };
}

}  // namespace cuboid_mapping_ros
