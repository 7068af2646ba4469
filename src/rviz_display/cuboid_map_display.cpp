// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_map_display.h"

#include "distance_layer.h"
#include "frontier_layer.h"

#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/color_property.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/properties/vector_property.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <pluginlib/class_list_macros.hpp>

#include <OgreCamera.h>
#include <OgreSceneNode.h>

#include <algorithm>

namespace cuboid_mapping_rviz {
namespace {

using rviz::BoolProperty;
using rviz::ColorProperty;
using rviz::FloatProperty;
using rviz::StatusProperty;
using rviz::StringProperty;

/// Minimum time for new faces in each frame.
constexpr double kBudget_s = 0.02;
/// Time for new faces relative to the rest of a frame, waiting included: a large map is not drawn a hundred
/// times before it is complete.
constexpr double kBudgetOfFrame = 2.0;
/// Maximum time for new faces in each frame, so that rviz stays responsive.
constexpr double kMaxBudget_s = 0.25;
constexpr std::chrono::milliseconds kReportPeriod{500};
/// Time without motion after which a view is at rest.
constexpr std::chrono::milliseconds kRest{300};
/// If frames of a view at rest take longer, it is drawn with coarser cells while it moves.
constexpr float kSlowFrame_s = 0.05F;
constexpr float kCoarserInMotion = 2.0F;

constexpr std::array<const char*, 3> kSetNames{"Occupied", "Free", "Frontier"};

/// The class of a set, or the frontier, as an index of its properties.
std::size_t kindOf(FaceSet set) {
  if (set == FaceSet::kOccupiedSlice) return 0;
  if (set == FaceSet::kFreeSlice) return 1;
  return static_cast<std::size_t>(set);
}

QString nameOf(FaceSet set) {
  return QString(kSetNames[kindOf(set)]) + (isSlice(set) ? " slice" : "");
}

}  // namespace

CuboidMapDisplay::CuboidMapDisplay() {
  addSourceProperties();
  addShownProperties();
  addColorProperties();
  addClipProperties();
  layers_.push_back(std::make_unique<DistanceLayer>(*this));
  layers_.push_back(std::make_unique<FrontierLayer>(*this));
}

CuboidMapDisplay::~CuboidMapDisplay() { disconnect(); }

// NOLINTBEGIN(cppcoreguidelines-owning-memory): rviz deletes properties with their display
void CuboidMapDisplay::addSourceProperties() {
  namespace_property_ = new StringProperty(
      "Topic namespace", "",
      "Namespace of the server, and of its topics cuboid_map and cuboid_map_updates.", this,
      SLOT(connectAnew()));
  server_property_ = new StringProperty(
      "Server", "cuboid_mapping",
      "Name of the node. Only this one is followed, unless it is cuboid_mapping.", this,
      SLOT(connectAnew()));
  file_property_ = new StringProperty(
      "Map file", "", "Show this file (.cuboids, .sqlite, .ot, .bt) instead of a topic.", this,
      SLOT(connectAnew()));
}

void CuboidMapDisplay::addShownProperties() {
  const std::array<const char*, 3> help{"Occupied cuboids.", "Free cuboids.",
                                        "Faces of free cuboids beside unknown space."};
  const std::array<QColor, 3> colors{QColor(77, 140, 230), QColor(120, 200, 120),
                                     QColor(240, 170, 40)};
  const std::array<float, 3> alphas{1.0F, 0.15F, 0.4F};
  for (std::size_t i = 0; i < set_properties_.size(); ++i) {
    SetProperties& set = set_properties_[i];
    set.shown = new BoolProperty(kSetNames[i], i == 0, help[i], this, SLOT(updateShown()), this);
    set.color = new ColorProperty("Color", colors[i], "Used if Color by is Class.", set.shown,
                                  SLOT(updateStyles()), this);
    set.alpha = new FloatProperty("Alpha", alphas[i], "0: invisible, 1: opaque.", set.shown,
                                  SLOT(updateStyles()), this);
    set.alpha->setMin(0.0F);
    set.alpha->setMax(1.0F);
  }
}

void CuboidMapDisplay::addColorProperties() {
  mode_property_ = new rviz::EnumProperty("Color by", "Height", "Meaning of the colors.", this,
                                          SLOT(updateStyles()));
  mode_property_->addOption("Height", static_cast<int>(ColorMode::kHeight));
  mode_property_->addOption("Probability", static_cast<int>(ColorMode::kProbability));
  mode_property_->addOption("Cuboid size", static_cast<int>(ColorMode::kSize));
  mode_property_->addOption("Class", static_cast<int>(ColorMode::kFlat));
  auto_heights_property_ = new BoolProperty(
      "Fit to heights", true,
      "Fit the colors to the heights of the map without the lowest and the highest 2 %.",
      mode_property_, SLOT(updateStyles()), this);
  min_color_property_ =
      new FloatProperty("Lowest", 0.0F, "Height of the first color, in m, without Fit to heights.",
                        mode_property_, SLOT(updateStyles()), this);
  max_color_property_ =
      new FloatProperty("Highest", 3.0F, "Height of the last color, in m, without Fit to heights.",
                        mode_property_, SLOT(updateStyles()), this);
  edges_property_ =
      new BoolProperty("Edges", true, "Draw the edges of cuboids.", this, SLOT(updateStyles()));
  joined_property_ = new BoolProperty(
      "Joined", false,
      "Join cuboids across bricks of 8 x 8 x 8 voxels. Joined cuboids end at multiples of 64 "
      "voxels.",
      this, SLOT(updateShown()));
  detail_property_ = new FloatProperty(
      "Finest detail", 4.0F,
      "Far away, cells of 2, 4 or 8 voxels replace cuboids, if they are no larger "
      "than this, in pixels. While the view moves, and frames take more than "
      "50 ms, they may be twice as large. 0: always cuboids. Needs Color by Height "
      "or Class, and Changed in last 0.",
      this);
  detail_property_->setMin(0.0F);
}

void CuboidMapDisplay::addClipProperties() {
  heights_property_ = new BoolProperty("Height range", false, "Show only a range of heights.", this,
                                       SLOT(updateStyles()));
  min_height_property_ = new FloatProperty("Min", 0.0F, "Lowest height in the map frame, in m.",
                                           heights_property_, SLOT(updateStyles()), this);
  max_height_property_ = new FloatProperty("Max", 2.0F, "Greatest height in the map frame, in m.",
                                           heights_property_, SLOT(updateStyles()), this);
  box_property_ = new BoolProperty("Clip box", false, "Show only the part of the map in a box.",
                                   this, SLOT(updateStyles()));
  box_min_property_ =
      new rviz::VectorProperty("Min", Ogre::Vector3(-5.0F), "Least corner in the map frame, in m.",
                               box_property_, SLOT(updateStyles()), this);
  box_max_property_ = new rviz::VectorProperty("Max", Ogre::Vector3(5.0F),
                                               "Greatest corner in the map frame, in m.",
                                               box_property_, SLOT(updateStyles()), this);
  slice_property_ =
      new BoolProperty("Slice", false, "Show the cross sections of cuboids at one height.", this,
                       SLOT(updateShown()), this);
  slice_height_property_ =
      new FloatProperty("Height", 1.0F, "Height of the slice in the map frame, in m.",
                        slice_property_, SLOT(updateShown()), this);
  below_property_ = new BoolProperty("Show below", false, "Also show the map below the slice.",
                                     slice_property_, SLOT(updateShown()), this);
  recent_property_ =
      new FloatProperty("Changed in last", 0.0F,
                        "Show only bricks that changed within this many seconds; 0: everything.",
                        this, SLOT(updateStyles()));
  recent_property_->setMin(0.0F);
}
// NOLINTEND(cppcoreguidelines-owning-memory)

void CuboidMapDisplay::onInitialize() { updateShown(); }

void CuboidMapDisplay::onEnable() { connectAnew(); }

void CuboidMapDisplay::onDisable() { disconnect(); }

void CuboidMapDisplay::reset() {
  Display::reset();
  connectAnew();
}

void CuboidMapDisplay::setTopic(const QString& topic, const QString& /*datatype*/) {
  file_property_->setValue(QString());
  namespace_property_->setValue(topic.section('/', 0, -2));
}

void CuboidMapDisplay::disconnect() {
  for (const auto& layer : layers_) layer->clear();
  has_map_ = false;
  scene_.reset();
  source_.reset();
}

void CuboidMapDisplay::connectAnew() {
  disconnect();
  if (!initialized() || !isEnabled()) return;
  const std::string file = file_property_->getStdString();
  try {
    if (file.empty()) {
      source_ = std::make_unique<FollowedMap>(namespace_property_->getStdString(),
                                              server_property_->getStdString());
    } else {
      source_ = std::make_unique<FileMap>(file);
    }
  } catch (const std::exception& exception) {  // The name is invalid in ROS.
    setStatusStd(StatusProperty::Error, "Map", exception.what());
    return;
  }
  deleteStatus("Map");
  scene_ = std::make_unique<FaceScene>(context_, *scene_node_, *source_);
  updateShown();
}

float CuboidMapDisplay::now_s() const {
  return std::chrono::duration<float>(Clock::now() - start_).count();
}

void CuboidMapDisplay::takeChanges() {
  for (const auto& changes : source_->takeChanges()) {
    if (changes.is_everything) updateShown();  // Its voxels may have another size.
    scene_->noteChanges(changes, now_s());
    for (const auto& layer : layers_) layer->noteChanges(changes);
    has_new_heights_ = has_map_ = true;
  }
}

bool CuboidMapDisplay::updateLayers() {
  rviz::ViewController* controller = context_->getViewManager()->getCurrent();
  if (controller == nullptr || !has_map_) return false;
  first_look_.update(*source_, *scene_node_, *controller);
  const ViewRay ray = findViewRay(*controller->getCamera(), *scene_node_);
  bool is_changed = false;
  for (const auto& layer : layers_) is_changed |= layer->update(*source_, *scene_node_, ray);
  return is_changed;
}

void CuboidMapDisplay::update(float wall_dt, float /*ros_dt*/) {
  if (scene_ == nullptr) return;
  takeChanges();
  chooseDetail(wall_dt);
  const bool is_placed = placeInFixedFrame();
  scene_node_->setVisible(is_placed);
  const Clock::time_point start = Clock::now();
  const double others_s = wall_dt - work_s_;
  const bool is_changed = scene_->update(std::chrono::duration<double>(
      std::clamp(kBudgetOfFrame * others_s, kBudget_s, kMaxBudget_s)));
  work_s_ = std::chrono::duration<double>(Clock::now() - start).count();
  if (recent_property_->getFloat() > 0.0F) updateStyles();  // Their oldest_s depends on the time.
  const bool has_new_layer = is_placed && updateLayers();
  if (is_changed || has_new_layer) context_->queueRender();
  if (Clock::now() - last_report_ < kReportPeriod) return;
  last_report_ = Clock::now();
  fitColorsToHeights();
  reportStatus();
}

void CuboidMapDisplay::chooseDetail(float frame_s) {
  const rviz::ViewController* controller = context_->getViewManager()->getCurrent();
  if (controller == nullptr) return;
  const Ogre::Matrix4 view = controller->getCamera()->getViewMatrix();
  const Clock::time_point now = Clock::now();
  if (view != view_) last_motion_ = now;
  view_ = view;
  const bool is_moving = now - last_motion_ < kRest;
  if (!is_moving) is_slow_at_rest_ = frame_s > kSlowFrame_s;
  scene_->setMaxCellPixels(detail_property_->getFloat() *
                           (is_moving && is_slow_at_rest_ ? kCoarserInMotion : 1.0F));
}

bool CuboidMapDisplay::placeInFixedFrame() {
  const std::string frame_id = source_->frameId();
  Ogre::Vector3 position = Ogre::Vector3::ZERO;
  Ogre::Quaternion orientation = Ogre::Quaternion::IDENTITY;
  if (!frame_id.empty() &&
      !context_->getFrameManager()->getTransform(frame_id, ros::Time(), position, orientation)) {
    setStatusStd(StatusProperty::Error, "Transform",
                 "No transform from " + frame_id + " to " + fixed_frame_.toStdString());
    return false;
  }
  deleteStatus("Transform");
  scene_node_->setPosition(position);
  scene_node_->setOrientation(orientation);
  return true;
}

void CuboidMapDisplay::fitColorsToHeights() {
  if (!has_new_heights_ || !auto_heights_property_->getBool()) return;
  has_new_heights_ = false;
  // The properties stay: rviz would count a change of them as a change of its configuration.
  source_->read([&](const cuboid_mapping::CuboidMap& map) { heights_ = findHeightRange(map); });
  updateStyles();
}

std::int32_t CuboidMapDisplay::sliceLayer() const {
  std::int32_t layer = 0;
  source_->read([&](const cuboid_mapping::CuboidMap& map) {
    layer = layerAt(map.grid(), slice_height_property_->getFloat());
  });
  return layer;
}

void CuboidMapDisplay::updateShown() {
  if (scene_ == nullptr) return;
  const bool is_sliced = slice_property_->getBool();
  const bool has_faces = !is_sliced || below_property_->getBool();
  if (is_sliced) scene_->setSliceLayer(sliceLayer());
  scene_->setJoined(joined_property_->getBool());
  for (const FaceSet set : kFaceSets) {
    const bool is_wanted = isSlice(set) ? is_sliced : has_faces;
    scene_->setShown(set, is_wanted && propertiesOf(set).shown->getBool());
  }
  updateStyles();
}

void CuboidMapDisplay::updateStyles() {
  if (scene_ == nullptr) return;
  for (const FaceSet set : kFaceSets) scene_->setStyle(set, styleOf(set));
  context_->queueRender();
}

const CuboidMapDisplay::SetProperties& CuboidMapDisplay::propertiesOf(FaceSet set) const {
  return set_properties_[kindOf(set)];
}

FaceStyle CuboidMapDisplay::styleOf(FaceSet set) const {
  const SetProperties& properties = propertiesOf(set);
  FaceStyle style;
  style.mode = static_cast<ColorMode>(mode_property_->getOptionInt());
  style.color = properties.color->getOgreColor();
  style.alpha = properties.alpha->getFloat();
  style.has_edges = edges_property_->getBool();
  const bool is_fitted = auto_heights_property_->getBool();
  style.min_color_m =
      is_fitted ? static_cast<float>(heights_.min_m) : min_color_property_->getFloat();
  style.max_color_m =
      is_fitted ? static_cast<float>(heights_.max_m) : max_color_property_->getFloat();
  if (recent_property_->getFloat() > 0.0F) style.oldest_s = now_s() - recent_property_->getFloat();
  clip(style);
  if (isSlice(set)) {  // A slice has its own height; the height range does not clip it.
    style.slice_m = slice_height_property_->getFloat();
    style.min_clip.z = FaceStyle().min_clip.z;
    style.max_clip.z = FaceStyle().max_clip.z;
  } else if (slice_property_->getBool()) {
    style.max_clip.z = std::min(style.max_clip.z, slice_height_property_->getFloat());
  }
  return style;
}

void CuboidMapDisplay::clip(FaceStyle& style) const {
  if (box_property_->getBool()) {
    style.min_clip = box_min_property_->getVector();
    style.max_clip = box_max_property_->getVector();
  }
  if (heights_property_->getBool()) {
    style.min_clip.z = std::max(style.min_clip.z, min_height_property_->getFloat());
    style.max_clip.z = std::min(style.max_clip.z, max_height_property_->getFloat());
  }
}

void CuboidMapDisplay::reportStatus() {
  const std::string fault = source_->fault();
  if (!fault.empty()) {
    setStatusStd(StatusProperty::Warn, "Map", fault);
    return;
  }
  std::uint64_t revision = 0;
  source_->read([&](const cuboid_mapping::CuboidMap& map) { revision = map.revision(); });
  QString text = QString("revision %1").arg(revision);
  if (!source_->stamp().isZero()) {
    const double delay_s = ros::Time::now().toSec() - source_->stamp().toSec();
    text += QString(", last cloud %1 s ago").arg(delay_s, 0, 'f', 1);
  }
  setStatus(StatusProperty::Ok, "Map", text);
  reportFaces();
  if (const std::size_t waiting = scene_->numWaiting(); waiting > 0) {
    setStatus(StatusProperty::Warn, "Picture", QString("%1 chunks wait").arg(waiting));
  } else {
    deleteStatus("Picture");
  }
}

void CuboidMapDisplay::reportFaces() {
  for (const FaceSet set : kFaceSets) {
    const QString name = nameOf(set);
    if (!scene_->isShown(set)) {
      deleteStatus(name);
      continue;
    }
    const FaceScene::Counts counts = scene_->counts(set);
    setStatus(StatusProperty::Ok, name,
              QString("%1 cuboids, %2 faces, %3 chunks, %4 MB")
                  .arg(counts.cuboids)
                  .arg(counts.faces)
                  .arg(counts.chunks)
                  .arg(1e-6 * static_cast<double>(counts.bytes), 0, 'f', 1));
  }
}

}  // namespace cuboid_mapping_rviz

PLUGINLIB_EXPORT_CLASS(cuboid_mapping_rviz::CuboidMapDisplay, rviz::Display)
