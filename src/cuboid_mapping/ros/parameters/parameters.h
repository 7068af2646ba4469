// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/ros/conversions/no_return_points.h"
#include "cuboid_mapping/ros/middleware/core_names.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/window/map_window.h"

#include <ros/node_handle.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <Eigen/Core>

#include <any>
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <typeindex>
#include <typeinfo>
#include <vector>

namespace cuboid_mapping_ros {

/// Message type of a source.
enum class SourceType : unsigned char {
  kPointCloud,  ///< sensor_msgs/PointCloud2
  kLaserScan,   ///< sensor_msgs/LaserScan
  kDepthImage   ///< sensor_msgs/Image with its sensor_msgs/CameraInfo
};

/// Name of the parameter's value, such as "laser_scan".
[[nodiscard]] const char* toString(SourceType type);

/// Effect of a source's beams on the map.
enum class SourceUse : unsigned char {
  kBoth,  ///< They mark their end as occupied, and clear the space before it.
  kMark,  ///< They only mark.
  kClear  ///< They only clear: the end of a beam changes nothing.
};

/// Parameters that only one feature or step reads, each a struct in its header: `parameters.of<StartParameters>()`.
class FeatureValues {
 public:
  template <typename T>
  [[nodiscard]] T& of() {
    std::any& value = values_[typeid(T)];
    if (!value.has_value()) value = T();
    return std::any_cast<T&>(value);
  }
  template <typename T>
  [[nodiscard]] const T& of() const {
    static const T kDefaults{};
    const auto found = values_.find(typeid(T));
    return found == values_.end() ? kDefaults : std::any_cast<const T&>(found->second);
  }

 private:
  std::map<std::type_index, std::any> values_;
};

/// Base of those that each source may set.
struct StepParameters {};

/// Parameters that each source may set.
struct SourceParameters : FeatureValues {
  std::string name;                 ///< Name in diagnostics and messages; empty: the topic.
  std::string topic = kCloudTopic;  ///< Name before remapping, in the namespace of the node.
  SourceType type = SourceType::kPointCloud;
  std::string camera_info;  ///< Topic, for depth images; empty: beside that of the image.
  SourceUse use = SourceUse::kBoth;
  double max_rate_hz = 0.0;       ///< Messages beyond this rate are ignored; 0: no limit.
  double length_unit_m = 0.0;     ///< Unit of its messages; 0: see lengthUnitOf().
  double old_depth_unit_m = 0.0;  ///< The same under an old name, for depth images.
  double old_point_unit_m = 0.0;  ///< The same under an old name, for other messages.
  std::string sensor_frame;  ///< Frame whose origin is the start of beams; "": the cloud's frame.
  double forget_after_s = 0.0;  ///< See Forgetting; 0: never.
  /// Probabilities of the source; the thresholds are those of the map.
  SensorModelConfig sensor_model;
  double max_range_m = std::numeric_limits<double>::infinity();  ///< Beams are cut there.
  bool keep_surfaces = false;                                    ///< See BeamRanges.
  double min_range_m = 0.0;        ///< Nearer points are left out wholly; 0: none.
  double no_return_range_m = 0.0;  ///< Beams without return free space up to it; 0: skipped.
  NoReturnPoints no_return_points = NoReturnPoints::kRep117;  ///< Readings that count as no return.
  NoReturnRanges no_return_ranges_m;                          ///< Ranges that stand for such beams.
  /// Points outside are left out with their beams; in the map's frame, with filter_ground in the base's.
  MetricBox crop = {Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9)};
  bool filter_ground = false;  ///< Whether points of the ground are no obstacles and free space.
};

/// Unit of the lengths in the messages of a source, in metres; 0: see CloudOptions.
[[nodiscard]] double lengthUnitOf(const SourceParameters& source);

/// The name of a source in diagnostics and messages.
[[nodiscard]] inline const std::string& nameOf(const SourceParameters& source) {
  return source.name.empty() ? source.topic : source.name;
}

/// Treatment of calls about parts of the map on disk, see MapWindow.
enum class QueriesOutside : unsigned char {
  kRefuse,  ///< The call is refused.
  kLoad     ///< The parts are loaded first.
};

/// Limits of one service call.
struct ServiceLimits {
  double max_time_s = 5.0;  ///< Time from when it has the map.
  /// Bricks of 8 x 8 x 8 voxels, cuboids and similar items that it reads.
  int max_bricks = 20000000;
  int max_entries = 1000000;  ///< Maximum number of entries of a request, and of its answer.
  int max_answer_mb = 100;    ///< Maximum size of an answer, MB.
  QueriesOutside outside = QueriesOutside::kRefuse;
};

/// Part of the map that stays in memory.
struct WindowParameters {
  std::string frame_id;  ///< Frame that the window moves with; empty: no window.
  WindowConfig config;
  std::string file;  ///< File of the store.

  [[nodiscard]] bool isOn() const { return !frame_id.empty(); }
  /// Whether there is a store.
  [[nodiscard]] bool keeps() const { return isOn() && config.outside == OutsideWindow::kKeep; }
};

/// Limits of the clouds kept for corrections of poses.
struct KeepParameters {
  int memory_mb = 0;       ///< Limit of packed clouds, in MB; 0: no cloud is kept.
  std::string body_frame;  ///< Frame of the corrected poses; empty: the frame of the cloud.

  [[nodiscard]] bool isOn() const { return memory_mb > 0; }
};

/// What is forgotten, see Forgetting.
enum class Forget : unsigned char {
  kAll,       ///< Voxels become unknown.
  kOccupied,  ///< Occupied voxels become unknown; free ones stay.
  kFree,      ///< Free voxels become unknown; occupied ones stay.
  kSeenOnce   ///< Voxels keep their class, but the next observation of the other class wins.
};

/// Treatment of points of moving objects, see MovingFilter.
enum class MovingPoints : unsigned char {
  kIgnore,   ///< They are not detected.
  kPublish,  ///< They are published, and go into the map.
  kLeaveOut  ///< They are published, and do not go into the map.
};

/// Parameters of the node, valid together when they come from readParameters() without an error.
///
/// Keys, units, ranges and help are declared once, see parameterTable(); the defaults are those of
/// the structs. Names of octomap_server are kept.
struct NodeParameters : FeatureValues {
  std::string frame_id = "map";  ///< Frame of the map.
  /// The only source; or the default parameters of the sources in the list.
  SourceParameters source;
  XmlRpc::XmlRpcValue source_list;        ///< List as given; not set: there is one source.
  std::vector<SourceParameters> sources;  ///< Sources from the list.
  /// Its sensor_model is that of `source`, see makeMapConfig().
  MapConfig map;
  std::string base_frame_id = "base_footprint";  ///< Frame of the robot, z = 0 on the ground.
  std::vector<std::string> robots;  ///< Robots that observe the map; none: clouds make it.
  Forget forget = Forget::kAll;
  MovingPoints moving_points = MovingPoints::kIgnore;
  int threads = 0;                  ///< Threads for a cloud; 0: one for each core.
  bool ignores_unknown = false;     ///< Unknown keys are warnings, not errors.
  int queue_size = 2;               ///< Clouds of a source that may wait for their turn.
  double tf_wait_s = 10.0;          ///< Longest time that a cloud waits for its transforms.
  double tf_gap_s = 1.0;            ///< Longest time between two transforms of a frame.
  double publish_rate_hz = 10.0;    ///< Greatest rate of the map topics.
  double keyframe_period_s = 10.0;  ///< Period of whole messages between differences; 0: none.
  bool publish_values = false;      ///< Whether cuboid_map carries log-odds, or classes alone.
  std::string map_file;             ///< Loaded at the start; empty: none.
  std::string autosave_file;        ///< Saved to now and then; empty: none.
  double autosave_period_s = 60.0;
  /// The file as it was read at the start: saves may replace it. Nothing: not read. No parameter.
  std::optional<FileVersion> autosave_version;
  ServiceLimits service_limits;
  WindowParameters window;
  KeepParameters keep;
};

/// The sources of the list, or the only one; never empty.
[[nodiscard]] std::vector<SourceParameters> sourcesOf(const NodeParameters& parameters);

/// One error in the parameters.
struct ParameterError {
  std::string key;      ///< Key relative to the private namespace, such as "sensor_model/hit".
  std::string message;  ///< The value, the allowed values, and the cure.

  friend bool operator==(const ParameterError& a, const ParameterError& b) {
    return a.key == b.key && a.message == b.message;
  }
};

/// Parameters and all their errors; use them only if `errors` is empty.
struct LoadedParameters {
  NodeParameters parameters;
  std::vector<ParameterError> errors;
  /// Warnings about keys that are ignored, or read as others.
  std::vector<ParameterError> warnings;
};

/// Reads and checks all parameters; missing ones keep their defaults.
///
/// Cases:
///   - a whole number is accepted as a number (YAML `1`), but neither a number as a whole number, nor
///     any other value as a boolean;
///   - NaN and infinity are out of range everywhere;
///   - a value of the wrong type or out of range keeps its default; parameters are checked
///     against each other only if each of them is good;
///   - a frame loses a slash at its start, with a warning;
///   - names that only octomap_server has (track_changes, ...) are ignored with a warning. Names that its
///     dynamic_reconfigure leaves on the parameter server, such as sensor_model_max_range, give a warning
///     and stand for sensor_model/max_range if that is not set;
///   - an element of `sources` is a group of its own: `name`, and any of the parameters that
///     concern a source, also as one key with a slash; missing ones are as outside the list. Errors name its
///     index and its name;
///   - values in the group `defaults` hold where the parameter itself is not set (launch files);
///   - a group unlike any of the node's is taken for that of another node below this node's name,
///     and gives a warning;
///   - other unknown keys are errors; outside the list of sources, warnings with ignore_unknown. The text names
///     the most similar known key.
///
/// @param private_namespace  A struct, nested for keys with a slash. Not set, or an empty string
///                           (which `nodelet load` leaves when there is no parameter): all
///                           defaults.
/// @return Errors in the order of the table, then of sets, then of sources, then of unknown keys.
[[nodiscard]] LoadedParameters readParameters(const XmlRpc::XmlRpcValue& private_namespace);

/// readParameters() of everything in the namespace of a node handle.
[[nodiscard]] LoadedParameters loadParameters(const ros::NodeHandle& private_handle);

/// Text of the parameter of this name; nothing if there is none.
using FindText = std::function<std::optional<std::string>(const std::string& name)>;

/// Looks in the private namespace of a node, and then in the namespaces above it.
[[nodiscard]] FindText findTextFrom(const ros::NodeHandle& private_nh);

/// Reads what parameters name, such as the robot's description. @throws std::runtime_error  if it cannot be read.
void readReferences(NodeParameters& parameters, const FindText& find_text);

/// One line for each parameter: "key: value unit", with "(default)" if it is. For the log.
[[nodiscard]] std::vector<std::string> toLogLines(const NodeParameters& parameters);

/// One line for each parameter of a source that differs from its value outside the list.
[[nodiscard]] std::vector<std::string> toSourceLines(const NodeParameters& parameters);

/// One line for each parameter that differs from another set: "key: value unit (word: other value)".
/// @param word  Name of the other set, such as "default" or "was".
[[nodiscard]] std::vector<std::string> toDifferenceLines(const NodeParameters& parameters,
                                                         const NodeParameters& others,
                                                         const std::string& word);

/// Maximum number of entries of an answer. @param entry_bytes  Size of an entry, > 0.
[[nodiscard]] std::size_t maxEntries(const ServiceLimits& limits, std::size_t entry_bytes);

/// Text such as "ended by its time, at most 5 s (parameter query/max_time)". @pre why is not kNone.
[[nodiscard]] std::string explain(BudgetLimit why, const ServiceLimits& limits);

}  // namespace cuboid_mapping_ros
