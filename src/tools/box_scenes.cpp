// SPDX-License-Identifier: BSD-3-Clause
#include "box_scenes.h"

#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace cuboid_mapping {
namespace {

struct Ending {
  const char* text;
  SceneFormat format;
};

constexpr Ending kEndings[] = {{".scene", SceneFormat::kMoveit}, {".yaml", SceneFormat::kCurobo},
                               {".yml", SceneFormat::kCurobo},   {".world", SceneFormat::kWorld},
                               {".sdf", SceneFormat::kSdf},      {".urdf", SceneFormat::kUrdf}};

/// Three numbers with a separator.
std::string row(const Eigen::Vector3d& vector, const char* separator = " ") {
  constexpr int kDigits = 12;  // Exact to millimetres far from the origin.
  return toText(vector.x(), kDigits) + separator + toText(vector.y(), kDigits) + separator +
         toText(vector.z(), kDigits);
}

Eigen::Vector3d centerOf(const MetricBox& box) { return 0.5 * (box.min_m + box.max_m); }
Eigen::Vector3d sizeOf(const MetricBox& box) { return box.max_m - box.min_m; }
std::string nameOf(std::size_t box) { return "box_" + std::to_string(box); }

std::string toXml(const std::string& text) {
  std::string escaped;
  for (const char letter : text) {
    switch (letter) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      default: escaped += letter;
    }
  }
  return escaped;
}

/// Name of the frame on one line; "map" if it is empty.
std::string nameOfFrame(const std::string& frame_id) {
  std::string name = frame_id.empty() ? "map" : frame_id;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return name;
}

/// An object for each box; without an object's own pose and subframes, which MoveIt 1.0 does not know.
std::string toMoveit(const BoxScene& scene) {
  std::string text = nameOfFrame(scene.frame_id) + '\n';
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    text += "* " + nameOf(i) + "\n1\nbox\n" + row(sizeOf(scene.boxes[i])) + '\n' +
            row(centerOf(scene.boxes[i])) + "\n0 0 0 1\n0 0 0 0\n";
  }
  return text + ".\n";
}

std::string toCurobo(const BoxScene& scene) {
  if (scene.boxes.empty()) return "cuboid: {}\n";
  std::string text = "cuboid:\n";
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    text += "  " + nameOf(i) + ":\n    dims: [" + row(sizeOf(scene.boxes[i]), ", ") +
            "]\n    pose: [" + row(centerOf(scene.boxes[i]), ", ") + ", 1, 0, 0, 0]\n";
  }
  return text;
}

std::string toSdfModel(const BoxScene& scene) {
  std::string text = "<model name=\"" + toXml(nameOfFrame(scene.frame_id)) +
                     "\">\n<static>true</static>\n<link name=\"boxes\">\n";
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    const std::string shape = " name=\"" + nameOf(i) + "\"><pose>" + row(centerOf(scene.boxes[i])) +
                              " 0 0 0</pose><geometry><box><size>" + row(sizeOf(scene.boxes[i])) +
                              "</size></box></geometry></";
    text.append("<collision").append(shape).append("collision>\n");
    text.append("<visual").append(shape).append("visual>\n");
  }
  return text + "</link>\n</model>\n";
}

std::string toSdf(const BoxScene& scene, bool is_world) {
  const std::string model = toSdfModel(scene);
  const std::string world =
      "<world name=\"default\">\n<light type=\"directional\" name=\"sun\"><cast_shadows>false"
      "</cast_shadows><direction>-0.5 0.1 -0.9</direction></light>\n" +
      model + "</world>\n";
  return "<?xml version=\"1.0\"?>\n<sdf version=\"1.6\">\n" + (is_world ? world : model) +
         "</sdf>\n";
}

std::string toUrdf(const BoxScene& scene) {
  std::string text = "<?xml version=\"1.0\"?>\n<robot name=\"map\">\n<link name=\"" +
                     toXml(nameOfFrame(scene.frame_id)) + "\">\n";
  for (const MetricBox& box : scene.boxes) {
    const std::string shape = "<origin xyz=\"" + row(centerOf(box)) +
                              "\" rpy=\"0 0 0\"/><geometry><box size=\"" + row(sizeOf(box)) +
                              "\"/></geometry>";
    text.append("<collision>").append(shape).append("</collision>\n");
    text.append("<visual>").append(shape).append("</visual>\n");
  }
  return text + "</link>\n</robot>\n";
}

}  // namespace

std::optional<SceneFormat> sceneFormatOfName(const std::string& file) {
  std::string ending = std::filesystem::path(file).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const Ending& known : kEndings) {
    if (ending == known.text) return known.format;
  }
  return std::nullopt;
}

std::string knownSceneEndings() {
  std::string endings;
  for (const Ending& known : kEndings) {
    endings += (endings.empty() ? "" : ", ") + std::string(known.text);
  }
  return endings;
}

std::string toSceneText(const BoxScene& scene, SceneFormat format) {
  switch (format) {
    case SceneFormat::kMoveit: return toMoveit(scene);
    case SceneFormat::kCurobo: return toCurobo(scene);
    case SceneFormat::kUrdf: return toUrdf(scene);
    default: return toSdf(scene, format == SceneFormat::kWorld);
  }
}

}  // namespace cuboid_mapping
