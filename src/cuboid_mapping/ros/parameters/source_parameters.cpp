// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/names.h>

#include <algorithm>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;
using S = SourceParameters;
using XmlRpc::XmlRpcValue;

constexpr char kListKey[] = "sources";
constexpr char kNameKey[] = "name";

bool isTopicOrEmpty(const std::string& text) {
  std::string error;
  return ros::names::validate(text, error);
}

bool isTopic(const std::string& text) { return !text.empty() && isTopicOrEmpty(text); }

/// Kind of the list of sources, whose elements are read after all other parameters, see readSources().
ParameterKind sourcesKind() {
  ParameterKind kind{"a list of groups of keys"};
  kind.set = [](P& p, const XmlRpcValue& list) -> std::string {
    if (!list.valid()) return {};  // No list is given.
    if (list.getType() != XmlRpcValue::TypeArray) return "begin each source with a dash";
    p.source_list = list;
    return {};
  };
  kind.get = [](const P& p) { return p.source_list; };
  return kind;
}

void readName(const XmlRpcValue& element, LoadedParameters& own) {
  const auto name = findValue(element, kNameKey);
  if (!name) return;
  own.parameters.source.name = textOf(*name).value_or("");
  if (own.parameters.source.name.empty()) {
    own.errors.push_back(
        {kNameKey, "is " + describe(*name) + ", but must be a text that is not empty"});
  }
}

void judgeKeys(const XmlRpcValue& element, LoadedParameters& own) {
  std::vector<std::string> keys_of_sources{kNameKey};
  std::vector<std::string> keys_of_map;
  for (const ParameterDeclaration& declaration : parameterTable()) {
    (declaration.kind.is_of_source ? keys_of_sources : keys_of_map).push_back(declaration.key);
  }
  const auto has = [](const std::vector<std::string>& keys, const std::string& key) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  for (const auto& [key, value] : leavesOf(element)) {
    if (has(keys_of_sources, key) || isOtherName(key, true)) continue;
    if (auto error = findRetired(key)) {
      own.errors.push_back(std::move(*error));
      continue;
    }
    own.errors.push_back(
        {key, has(keys_of_map, key)
                  ? "concerns the whole map: write it outside the list"
                  : describeUnknown(key, value, "a source has no such", keys_of_sources) +
                        " Correct the key, or remove it"});
  }
}

/// Reads one element of the list. @param own  Has the parameters outside the list.
void readSource(const XmlRpcValue& element, LoadedParameters& own) {
  if (element.getType() != XmlRpcValue::TypeStruct) {
    own.errors.push_back({"", "is " + describe(element) + ", but must be a group of keys"});
    return;
  }
  readName(element, own);
  readGroup(element, true, own);
  if (!element.hasMember("topic")) {
    own.errors.push_back({"topic", "is missing: name the topic of this source"});
  }
  judgeKeys(element, own);
}

}  // namespace

const char* toString(SourceType type) {
  if (type == SourceType::kDepthImage) return "depth_image";
  return type == SourceType::kLaserScan ? "laser_scan" : "point_cloud";
}

std::vector<ParameterDeclaration> declareSources() {
  return {
      {"topic", "", text("a topic", &S::topic, isTopic),
       "Topic of the only sensor, before remapping."},
      {"type", "",
       choice<SourceType>(&S::type, {{"point_cloud", SourceType::kPointCloud},
                                     {"laser_scan", SourceType::kLaserScan},
                                     {"depth_image", SourceType::kDepthImage}}),
       "Message type of the sensor. point_cloud: sensor_msgs/PointCloud2. laser_scan: "
       "sensor_msgs/LaserScan. depth_image: sensor_msgs/Image, with the sensor_msgs/CameraInfo of "
       "its stamp, or the nearest."},
      {"camera_info", "", text("a topic, or empty", &S::camera_info, isTopicOrEmpty),
       "Topic of the sensor_msgs/CameraInfo of a depth image. Empty: camera_info beside the topic "
       "of the image."},
      {"use", "",
       choice<SourceUse>(
           &S::use,
           {{"both", SourceUse::kBoth}, {"mark", SourceUse::kMark}, {"clear", SourceUse::kClear}}),
       "Effect of the beams. both: they mark and clear. mark: their ends become occupied. clear: "
       "the space before their ends becomes free."},
      {"max_rate", "Hz", number(&S::max_rate_hz, 0.0, 1000.0),
       "Maximum rate of messages, by their stamps; others are ignored. 0: no limit."},
      {"length_unit", "m", number(&S::length_unit_m, 0.0, 1.0),
       "Unit of points, ranges and depths; 0.0002 in the depth images of TUM. 0: metres, but 16UC1 "
       "is in millimetres (REP 118), and 32FC1 with whole numbers above 100, too. Depths that no "
       "camera measures, and clouds with half of the points more than 1 km away, are refused."},
      {kListKey, "", sourcesKind(),
       "Several sensors. Each element has a topic, an optional name, and the values that differ "
       "from those outside the list: type, camera_info, use, max_rate, deskew, *_unit, "
       "sensor_frame, forget_after, sensor_model/hit, miss, max_range, keep_surfaces, min_range, "
       "no_return_range and no_return_points, filter_ground, ground_filter/*, pointcloud_*. See "
       "doc/sensors.md."},
  };
}

double lengthUnitOf(const SourceParameters& source) {
  if (source.length_unit_m > 0.0) return source.length_unit_m;
  const bool is_depth = source.type == SourceType::kDepthImage;
  return is_depth ? source.old_depth_unit_m : source.old_point_unit_m;
}

void readSources(LoadedParameters& loaded) {
  const XmlRpcValue list = loaded.parameters.source_list;
  if (!list.valid()) return;
  const LoadedParameters outside = loaded;
  for (int i = 0; i < list.size(); ++i) {
    LoadedParameters own{outside.parameters, {}, {}};
    readSource(list[i], own);
    const std::string name = nameOf(own.parameters.source);
    for (const SourceParameters& other : loaded.parameters.sources) {
      if (nameOf(other) != name) continue;
      own.errors.push_back(
          {kNameKey, "is that of another source, too: give each source a name of its own"});
    }
    const auto pass_on = [&](const std::vector<ParameterError>& from,
                             const std::vector<ParameterError>& said,
                             std::vector<ParameterError>& to) {
      for (const ParameterError& error : from) {
        // Conflicts outside the list are reported there.
        if (std::find(said.begin(), said.end(), error) != said.end()) continue;
        to.push_back({std::string(kListKey) + '[' + std::to_string(i) + ']' +
                          (error.key.empty() ? "" : '/' + error.key),
                      error.message + " (source " + name + ')'});
      }
    };
    pass_on(own.errors, outside.errors, loaded.errors);
    pass_on(own.warnings, {}, loaded.warnings);
    loaded.parameters.sources.push_back(std::move(own.parameters.source));
  }
}

std::vector<SourceParameters> sourcesOf(const NodeParameters& parameters) {
  if (parameters.sources.empty()) return {parameters.source};
  return parameters.sources;
}

}  // namespace cuboid_mapping_ros
