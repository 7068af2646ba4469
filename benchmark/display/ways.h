// SPDX-License-Identifier: BSD-3-Clause
// The ways to show a map in rviz that are compared, all over topics.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "rviz_display/cuboid_map_display.h"
#include "rviz_display/rviz_window.h"

#include <ros/ros.h>

#include <memory>
#include <vector>

namespace cuboid_mapping_rviz::bench {

/// Shows the occupied cuboids of a map.
class Way {
 public:
  virtual ~Way() = default;

  [[nodiscard]] virtual const char* name() const = 0;
  /// Adds its display to the window, and sends all of the map.
  virtual void load(test::RvizWindow& window, const cuboid_mapping::CuboidMap& map) = 0;
  /// Whether all of the map is drawn. @pre No other way is visible.
  [[nodiscard]] virtual bool isDrawn(test::RvizWindow& window) const;
  /// Sends a change. @return Bytes that the graphics card gets for it; nothing: see numUploadedBytes().
  virtual std::optional<double> send(const cuboid_mapping::CuboidMap& map,
                                     const cuboid_mapping::ChangeSet& changes) = 0;
  /// Of vertices on the card.
  [[nodiscard]] virtual double numBytes() const;
  /// Uploaded so far, where that is counted.
  [[nodiscard]] virtual double numUploadedBytes() const { return 0.0; }
  /// What rviz does with its display before a frame. @param frame_s  Since the frame before.
  void update(double frame_s) { display_->update(static_cast<float>(frame_s), 0.0F); }
  /// Out of the scene, without any change of its data, or into it again.
  void setVisible(bool is_visible);

 protected:
  ros::NodeHandle nh_;
  double num_boxes_ = 0.0;
  rviz::Display* display_ = nullptr;

 private:
  bool is_visible_ = true;
  Ogre::SceneNode* parent_ = nullptr;
};

/// The display of this package.
class DisplayWay : public Way {
 public:
  [[nodiscard]] const char* name() const override { return "display"; }
  void load(test::RvizWindow& window, const cuboid_mapping::CuboidMap& map) override;
  [[nodiscard]] bool isDrawn(test::RvizWindow& window) const override;
  std::optional<double> send(const cuboid_mapping::CuboidMap& map,
                             const cuboid_mapping::ChangeSet& changes) override;
  [[nodiscard]] double numBytes() const override;
  [[nodiscard]] double numUploadedBytes() const override;
  [[nodiscard]] const FaceScene& scene() const;
  /// A setting, by the names of properties on the way to it.
  void set(const std::vector<QString>& names, const QVariant& value);

 private:
  ros::Publisher updates_;
  ros::Publisher images_;
  std::uint64_t revision_ = 0;
};

/// The display, and as peers the marker topic, and the way of octomap_rviz_plugins: a cloud of boxes.
[[nodiscard]] std::vector<std::unique_ptr<Way>> makeAllWays();

}  // namespace cuboid_mapping_rviz::bench
