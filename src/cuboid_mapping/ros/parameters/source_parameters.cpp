// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/nearest_key.h"
#include "cuboid_mapping/ros/parameters/parameter_reader.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/names.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;
using XmlRpc::XmlRpcValue;

constexpr char kListKey[] = "sources";
constexpr char kNameKey[] = "name";

/// Groups of keys that a source may have of its own; a group is a key, or all that begins with it and a slash.
constexpr std::array<const char*, 18> kSourceKeys{"topic",
                                                  "type",
                                                  "camera_info",
                                                  "use",
                                                  "max_rate",
                                                  "deskew",
                                                  "depth_unit",
                                                  "sensor_frame",
                                                  "forget_after",
                                                  "sensor_model/hit",
                                                  "sensor_model/miss",
                                                  "sensor_model/max_range",
                                                  "sensor_model/end_margin",
                                                  "sensor_model/min_range",
                                                  "sensor_model/no_return_range",
                                                  "sensor_model/no_return_points",
                                                  "filter_ground",
                                                  "ground_filter"};

bool isTopic(const std::string& text) {
  std::string error;
  return ros::names::validate(text, error);
}

TextKind topicKind() {
  return {"a topic",
          [](P& p, const std::string& text) {
            if (text.empty() || !isTopic(text)) return false;
            p.source.topic = text;
            return true;
          },
          [](const P& p) { return p.source.topic; }};
}

TextKind cameraInfoKind() {
  return {"a topic, or empty",
          [](P& p, const std::string& text) {
            if (!isTopic(text)) return false;
            p.source.camera_info = text;
            return true;
          },
          [](const P& p) { return p.source.camera_info; }};
}

ListKind sourcesKind() {
  return {"a list of groups of keys",
          [](P& p, const XmlRpcValue& list) -> std::string {  // Its elements: see readSources().
            if (list.getType() != XmlRpcValue::TypeArray) return "begin each source with a dash";
            p.source_list = list;
            return {};
          },
          [](const P& p) { return p.source_list; },
          [](const P& p) {
            std::string names;
            for (const P& source : p.sources) {
              names += (names.empty() ? "" : ", ") + nameOf(source);
            }
            return '[' + names + ']';
          }};
}

/// One element of the list, while it is read.
class SourceReader {
 public:
  SourceReader(std::size_t index, const LoadedParameters& outer)
      : prefix_(std::string(kListKey) + '[' + std::to_string(index) + ']'), outer_(outer) {
    own_.parameters = outer.parameters;
  }

  void read(const XmlRpcValue& element) {
    if (element.getType() != XmlRpcValue::TypeStruct) {
      return fail("", "is " + describe(element) + ", but must be a group of keys");
    }
    readName(element);
    readGroup(element, isOfSource, own_);
    if (!element.hasMember("topic")) fail("topic", "is missing: name the topic of this source");
    judgeKeys(element);
  }

  /// Brings what was read to the others, or what is wrong with it.
  void finish(LoadedParameters& loaded) {
    const std::string& name = nameOf(own_.parameters);
    for (const NodeParameters& other : loaded.parameters.sources) {
      if (nameOf(other) != name) continue;
      fail(kNameKey, "is that of another source, too: give each source a name of its own");
    }
    const auto pass_on = [&](const std::vector<ParameterError>& from,
                             std::vector<ParameterError>& to) {
      for (const ParameterError& error : from) {
        to.push_back({prefix_ + (error.key.empty() ? "" : '/' + error.key),
                      error.message + " (source " + name + ')'});
      }
    };
    pass_on(own_.errors, loaded.errors);
    pass_on(own_.warnings, loaded.warnings);
    loaded.parameters.sources.push_back(std::move(own_.parameters));
  }

 private:
  void fail(const std::string& key, const std::string& message) {
    own_.errors.push_back({key, message});
  }

  void readName(const XmlRpcValue& element) {
    if (!element.hasMember(kNameKey)) return;
    XmlRpcValue name = element[kNameKey];
    if (name.getType() != XmlRpcValue::TypeString || name.size() == 0) {
      return fail(kNameKey, "is " + describe(name) + ", but must be a text");
    }
    own_.parameters.source.name = static_cast<std::string&>(name);
  }

  void judgeKeys(const XmlRpcValue& element) {
    // What does not fit together outside the list is said there.
    const auto is_inherited = [this](const ParameterError& error) {
      return std::any_of(outer_.errors.begin(), outer_.errors.end(), [&](const auto& other) {
        return other.key == error.key && other.message == error.message;
      });
    };
    own_.errors.erase(std::remove_if(own_.errors.begin(), own_.errors.end(), is_inherited),
                      own_.errors.end());
    std::vector<std::string> known_keys{kNameKey};
    std::set<std::string> all_keys;
    for (const ParameterDeclaration& declaration : parameterTable()) {
      all_keys.insert(declaration.key);
      if (isOfSource(declaration.key)) known_keys.push_back(declaration.key);
    }
    for (const auto& [key, value] : leavesOf(element)) {
      if (key == kNameKey || isOfSource(key)) continue;
      if (all_keys.count(key) > 0) {
        fail(key, "concerns the whole map: write it outside the list");
        continue;
      }
      const auto nearest = findNearestKey(key, known_keys);
      fail(key, "is " + describe(value) + ", but a source has no such parameter" +
                    (nearest ? ": did you mean " + *nearest + '?' : ".") +
                    " Correct the key, or remove it");
    }
  }

  std::string prefix_;
  const LoadedParameters& outer_;
  LoadedParameters own_;
};

}  // namespace

const char* toString(SourceType type) {
  switch (type) {
    case SourceType::kPointCloud: return "point_cloud";
    case SourceType::kLaserScan: return "laser_scan";
    case SourceType::kDepthImage: break;
  }
  return "depth_image";
}

const char* toString(SourceUse use) {
  switch (use) {
    case SourceUse::kBoth: return "both";
    case SourceUse::kMark: return "mark";
    case SourceUse::kClear: break;
  }
  return "clear";
}

const char* toString(ForgetClass forgotten) {
  switch (forgotten) {
    case ForgetClass::kAll: return "all";
    case ForgetClass::kOccupied: return "occupied";
    case ForgetClass::kFree: break;
  }
  return "free";
}

const char* toString(ForgetTo forget_to) {
  return forget_to == ForgetTo::kUnknown ? "unknown" : "seen_once";
}

const char* toString(MovingPoints moving) {
  switch (moving) {
    case MovingPoints::kIgnore: return "ignore";
    case MovingPoints::kPublish: return "publish";
    case MovingPoints::kLeaveOut: break;
  }
  return "leave_out";
}

bool isOfSource(const std::string& key) {
  return key.rfind("pointcloud_", 0) == 0 ||
         std::any_of(kSourceKeys.begin(), kSourceKeys.end(), [&key](const std::string& group) {
           return key == group || key.rfind(group + '/', 0) == 0;
         });
}

std::vector<ParameterDeclaration> declareSources() {
  return {
      {"topic", "", topicKind(),
       "Topic of the sensor, if there is only one; its name before remapping."},
      {"type", "",
       oneOf<SourceType>({SourceType::kPointCloud, SourceType::kLaserScan, SourceType::kDepthImage},
                         [](P& p) -> SourceType& { return p.source.type; }),
       "Type of its messages. point_cloud: sensor_msgs/PointCloud2. laser_scan: "
       "sensor_msgs/LaserScan. depth_image: sensor_msgs/Image, with the sensor_msgs/CameraInfo of "
       "its stamp, or the nearest."},
      {"camera_info", "", cameraInfoKind(),
       "Topic of the sensor_msgs/CameraInfo of a depth image. Empty: camera_info beside the topic "
       "of the image."},
      {"use", "",
       oneOf<SourceUse>({SourceUse::kBoth, SourceUse::kMark, SourceUse::kClear},
                        [](P& p) -> SourceUse& { return p.source.use; }),
       "What its beams do. mark: their ends become occupied. clear: the space before their ends "
       "becomes free."},
      {"max_rate", "Hz",
       NumberKind{[](P& p) -> double& { return p.source.max_rate_hz; }, 0.0, 1000.0},
       "Maximum rate of its messages; those beyond it are ignored, by their stamps. 0: no limit."},
      {"deskew", "", BooleanKind{[](P& p) -> bool& { return p.source.deskew; }},
       "true: each point is put where the sensor was when it was measured, by tf: by the field "
       "time, t, offset_time or timestamp of a cloud, by time_increment of a scan. false: all as "
       "of the stamp."},
      {"depth_unit", "m",
       NumberKind{[](P& p) -> double& { return p.source.depth_unit_m; }, 1e-6, 1.0},
       "What 1 stands for in a depth image of whole numbers (16UC1): 0.001 by REP 118; 0.0002 in "
       "the data sets of TUM. 32FC1 is in metres."},
      {kListKey, "", sourcesKind(),
       "Several sensors. Each element has a topic, maybe a name, and whatever differs from the "
       "values outside the list: type, camera_info, use, max_rate, deskew, depth_unit, "
       "sensor_frame, "
       "forget_after, sensor_model/hit, miss, max_range, end_margin, min_range, no_return_range "
       "and no_return_points, filter_ground, ground_filter/*, pointcloud_*. See doc/sensors.md."},
      {"order_wait", "s", NumberKind{[](P& p) -> double& { return p.order_wait_s; }, 0.0, 10.0},
       "Clouds of several sources are put into the map in the order of their stamps. A cloud "
       "waits for earlier ones of other sources up to this time, in wall time."},
  };
}

void readSources(LoadedParameters& loaded) {
  const XmlRpcValue list = loaded.parameters.source_list;
  if (list.getType() != XmlRpcValue::TypeArray) return;
  const LoadedParameters outer = loaded;
  for (int i = 0; i < list.size(); ++i) {
    SourceReader reader(static_cast<std::size_t>(i), outer);
    reader.read(list[i]);
    reader.finish(loaded);
  }
}

std::vector<NodeParameters> sourcesOf(const NodeParameters& parameters) {
  if (parameters.sources.empty()) return {parameters};
  std::vector<NodeParameters> sources = parameters.sources;
  for (NodeParameters& source : sources) {
    // What concerns the whole map may have been changed since the list was read, as by a map file.
    const cuboid_mapping::SensorModelConfig own = source.map.sensor_model;
    source.map = parameters.map;
    source.map.sensor_model.hit = own.hit;
    source.map.sensor_model.miss = own.miss;
    source.self_filter.parts = parameters.self_filter.parts;
  }
  return sources;
}

const std::string& nameOf(const NodeParameters& source) {
  return source.source.name.empty() ? source.source.topic : source.source.name;
}

}  // namespace cuboid_mapping_ros
