// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifndef Q_MOC_RUN
#include "face_scene.h"
#include "first_look.h"
#include "map_layer.h"
#include "map_source.h"

#include "cuboid_mapping/query/height_range.h"

#include <rviz/display.h>
#endif

#include <OgreMatrix4.h>

#include <chrono>
#include <memory>
#include <vector>

namespace rviz {
class BoolProperty;
class ColorProperty;
class EnumProperty;
class FloatProperty;
class StringProperty;
class VectorProperty;
}  // namespace rviz

namespace cuboid_mapping_rviz {

/// rviz's display of a map: follows the topics of a node as CuboidMapClient does, or reads a file, and draws
/// the exposed faces of its cuboids.
class CuboidMapDisplay : public rviz::Display {
  Q_OBJECT
 public:
  CuboidMapDisplay();
  ~CuboidMapDisplay() override;

  void update(float wall_dt, float ros_dt) override;
  void reset() override;
  /// Called by rviz for "Add, by topic". @param topic  A topic cuboid_map; the display follows its namespace.
  void setTopic(const QString& topic, const QString& datatype) override;

  /// The drawn scene; null while the display is off.
  [[nodiscard]] const FaceScene* scene() const { return scene_.get(); }

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private Q_SLOTS:
  void connectAnew();
  void updateShown();
  void updateStyles();

 private:
  using Clock = std::chrono::steady_clock;
  struct SetProperties {
    rviz::BoolProperty* shown = nullptr;
    rviz::ColorProperty* color = nullptr;
    rviz::FloatProperty* alpha = nullptr;
  };

  void addSourceProperties();
  void addShownProperties();
  void addColorProperties();
  void addClipProperties();
  void disconnect();
  void takeChanges();
  [[nodiscard]] float now_s() const;
  /// Chooses coarser cells while the view moves, if rendering is slow. @param frame_s  Time of the last frame.
  void chooseDetail(float frame_s);
  [[nodiscard]] bool placeInFixedFrame();
  /// @return Whether the drawing has changed.
  bool updateLayers();
  void fitColorsToHeights();
  [[nodiscard]] const SetProperties& propertiesOf(FaceSet set) const;
  [[nodiscard]] FaceStyle styleOf(FaceSet set) const;
  [[nodiscard]] std::int32_t sliceLayer() const;
  void clip(FaceStyle& style) const;
  void reportStatus();
  void reportFaces();

  std::unique_ptr<MapSource> source_;
  std::unique_ptr<FaceScene> scene_;               ///< Destroyed before the source.
  std::vector<std::unique_ptr<MapLayer>> layers_;  ///< Cleared before the source is destroyed.
  FirstLook first_look_{*this};
  bool has_map_ = false;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point last_report_;
  cuboid_mapping::HeightRange heights_;  ///< Heights of the map, for its colors.
  bool has_new_heights_ = false;
  double work_s_ = 0.0;  ///< Time of the last update of the scene.
  Ogre::Matrix4 view_ = Ogre::Matrix4::ZERO;
  Clock::time_point last_motion_;
  bool is_slow_at_rest_ = false;

  rviz::StringProperty* namespace_property_ = nullptr;
  rviz::StringProperty* server_property_ = nullptr;
  rviz::StringProperty* file_property_ = nullptr;
  /// By FaceSet; slices use the properties of their class.
  std::array<SetProperties, 3> set_properties_;
  rviz::EnumProperty* mode_property_ = nullptr;
  rviz::BoolProperty* auto_heights_property_ = nullptr;
  rviz::FloatProperty* min_color_property_ = nullptr;
  rviz::FloatProperty* max_color_property_ = nullptr;
  rviz::BoolProperty* edges_property_ = nullptr;
  rviz::BoolProperty* joined_property_ = nullptr;
  rviz::FloatProperty* detail_property_ = nullptr;
  rviz::BoolProperty* heights_property_ = nullptr;
  rviz::FloatProperty* min_height_property_ = nullptr;
  rviz::FloatProperty* max_height_property_ = nullptr;
  rviz::BoolProperty* box_property_ = nullptr;
  rviz::VectorProperty* box_min_property_ = nullptr;
  rviz::VectorProperty* box_max_property_ = nullptr;
  rviz::BoolProperty* slice_property_ = nullptr;
  rviz::FloatProperty* slice_height_property_ = nullptr;
  rviz::BoolProperty* below_property_ = nullptr;
  rviz::FloatProperty* recent_property_ = nullptr;
};

}  // namespace cuboid_mapping_rviz
