// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifndef Q_MOC_RUN
#include "face_scene.h"
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

/// rviz's display of a map: it follows the topics of a node with the rules of CuboidMapClient, or
/// reads a file, keeps the map, and draws the exposed faces of its cuboids.
class CuboidMapDisplay : public rviz::Display {
  Q_OBJECT
 public:
  CuboidMapDisplay();
  ~CuboidMapDisplay() override;

  void update(float wall_dt, float ros_dt) override;
  void reset() override;
  /// rviz's "Add, by topic". @param topic  A cuboid_map, in the namespace that is followed.
  void setTopic(const QString& topic, const QString& datatype) override;

  /// What is drawn; nothing while the display is off.
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
  /// While the view moves, a slow renderer gets coarser cells. @param frame_s  Time of the last frame.
  void chooseDetail(float frame_s);
  [[nodiscard]] bool placeInFixedFrame();
  /// @return Whether something else is drawn.
  bool updateLayers();
  void fitColorsToHeights();
  [[nodiscard]] const SetProperties& propertiesOf(FaceSet set) const;
  [[nodiscard]] FaceStyle styleOf(FaceSet set) const;
  [[nodiscard]] std::int32_t sliceLayer() const;
  void clip(FaceStyle& style) const;
  void reportStatus();
  void reportFaces();

  std::unique_ptr<MapSource> source_;
  std::unique_ptr<FaceScene> scene_;               ///< Goes before the source.
  std::vector<std::unique_ptr<MapLayer>> layers_;  ///< They are cleared before the source goes.
  bool has_map_ = false;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point last_report_;
  cuboid_mapping::HeightRange heights_;  ///< Of the map, for its colors.
  bool has_new_heights_ = false;
  double work_s_ = 0.0;  ///< Of the last update of the scene.
  Ogre::Matrix4 view_ = Ogre::Matrix4::ZERO;
  Clock::time_point last_motion_;
  bool is_slow_at_rest_ = false;

  rviz::StringProperty* namespace_property_ = nullptr;
  rviz::StringProperty* server_property_ = nullptr;
  rviz::StringProperty* file_property_ = nullptr;
  std::array<SetProperties, 3> set_properties_;  ///< By FaceSet; slices have those of their class.
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
