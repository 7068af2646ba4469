// SPDX-License-Identifier: BSD-3-Clause
#include "ways.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/markers/marker_cache.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include <sensor_msgs/PointCloud2.h>

#include <OgreSceneNode.h>

namespace cuboid_mapping_rviz::bench {
namespace {

using namespace cuboid_mapping;

/// Of rviz's own boxes: 36 vertices of 28 bytes, without an index.
constexpr double kBytesPerRvizBox = 36.0 * 28.0;

std_msgs::Header inMap() {
  std_msgs::Header header;
  header.frame_id = "map";
  return header;
}

class MarkerWay : public Way {
 public:
  [[nodiscard]] const char* name() const override { return "markers"; }
  void load(test::RvizWindow& window, const CuboidMap& map) override {
    cache_ = std::make_unique<cuboid_mapping_ros::MarkerCache>(map.grid(),
                                                               cuboid_mapping_ros::MarkerStyle{});
    publisher_ = nh_.advertise<visualization_msgs::MarkerArray>("occupied_cuboids", 10, true);
    num_boxes_ = static_cast<double>(countCuboids(map).occupied);
    publisher_.publish(update(map));
    display_ = window.addDisplay("rviz/MarkerArray", false);
    display_->subProp("Marker Topic")->setValue("occupied_cuboids");
    display_->setEnabled(true);
  }
  std::optional<double> send(const CuboidMap& map, const ChangeSet& changes) override {
    cache_->noteChanges(changes);
    const visualization_msgs::MarkerArray markers = update(map);
    std::size_t num_boxes = 0;
    for (const auto& marker : markers.markers) num_boxes += marker.points.size();
    publisher_.publish(markers);
    return kBytesPerRvizBox * static_cast<double>(num_boxes);
  }

 private:
  visualization_msgs::MarkerArray update(const CuboidMap& map) {
    cache_->read(map, Budget::unlimited());
    return cache_->takeDifference(inMap());
  }

  std::unique_ptr<cuboid_mapping_ros::MarkerCache> cache_;
  ros::Publisher publisher_;
};

class CloudWay : public Way {
 public:
  [[nodiscard]] const char* name() const override { return "cloud of boxes"; }
  void load(test::RvizWindow& window, const CuboidMap& map) override {
    publisher_ = nh_.advertise<sensor_msgs::PointCloud2>("boxes", 10, true);
    publish(map);
    display_ = window.addDisplay("rviz/PointCloud2", false);
    display_->subProp("Topic")->setValue("boxes");
    display_->subProp("Style")->setValue("Boxes");
    display_->subProp("Size (m)")->setValue(map.grid().resolution());
    display_->setEnabled(true);
  }
  std::optional<double> send(const CuboidMap& map, const ChangeSet& /*changes*/) override {
    publish(map);
    return numBytes();
  }

 private:
  /// All boxes have one size here: such a cloud knows no other. That is in its favour.
  void publish(const CuboidMap& map) {
    std::vector<Eigen::Vector3d> centers;
    visitAll(map, CuboidFilter::kOccupied, [&](const Cuboid& cuboid) {
      centers.push_back(map.grid().centerOf(cuboid.box));
      return Visit::kContinue;
    });
    num_boxes_ = static_cast<double>(centers.size());
    publisher_.publish(cuboid_mapping_ros::toCloud(centers, inMap()));
  }

  ros::Publisher publisher_;
};

}  // namespace

bool Way::isDrawn(test::RvizWindow& window) const {
  return static_cast<double>(window.statistics().triangleCount) > 11.9 * num_boxes_;
}

double Way::numBytes() const { return kBytesPerRvizBox * num_boxes_; }

void Way::setVisible(bool is_visible) {
  if (is_visible == is_visible_) return;
  is_visible_ = is_visible;
  Ogre::SceneNode* node = display_->getSceneNode();
  if (is_visible) {
    parent_->addChild(node);
  } else {
    parent_ = node->getParentSceneNode();
    parent_->removeChild(node);
  }
}

void DisplayWay::load(test::RvizWindow& window, const CuboidMap& map) {
  updates_ = nh_.advertise<CuboidMapUpdate>(cuboid_mapping_ros::kCuboidMapUpdatesTopic, 20);
  images_ = nh_.advertise<FullCuboidMap>(cuboid_mapping_ros::kCuboidMapTopic, 1, true);
  cuboid_mapping_ros::ImageMessage message;
  message.image = makeImage(map, 1, MapDetail::kClasses);
  message.image.label.frame_id = inMap().frame_id;
  message.server = ros::this_node::getName();
  images_.publish(toMessage(message));
  revision_ = map.revision();
  display_ = window.addDisplay("cuboid_mapping/CuboidMap");
}

const FaceScene& DisplayWay::scene() const {
  return *dynamic_cast<const CuboidMapDisplay&>(*display_).scene();
}

bool DisplayWay::isDrawn(test::RvizWindow& /*window*/) const {
  return scene().counts(FaceSet::kOccupied).faces > 0 && scene().numWaiting() == 0;
}

std::optional<double> DisplayWay::send(const CuboidMap& map, const ChangeSet& changes) {
  cuboid_mapping_ros::DeltaMessage message;
  message.delta = makeDelta(map, changes, 1, revision_, MapDetail::kClasses);
  message.delta.label.frame_id = inMap().frame_id;
  message.server = ros::this_node::getName();
  updates_.publish(toMessage(message));
  revision_ = map.revision();
  return std::nullopt;
}

double DisplayWay::numBytes() const {
  return static_cast<double>(scene().counts(FaceSet::kOccupied).bytes);
}

double DisplayWay::numUploadedBytes() const {
  return static_cast<double>(scene().numUploadedBytes());
}

void DisplayWay::set(const std::vector<QString>& names, const QVariant& value) {
  rviz::Property* property = display_;
  for (const QString& name : names) property = property->subProp(name);
  property->setValue(value);
}

std::vector<std::unique_ptr<Way>> makeAllWays() {
  std::vector<std::unique_ptr<Way>> ways;
  ways.push_back(std::make_unique<DisplayWay>());
  ways.push_back(std::make_unique<MarkerWay>());
  ways.push_back(std::make_unique<CloudWay>());
  return ways;
}

}  // namespace cuboid_mapping_rviz::bench
