// SPDX-License-Identifier: BSD-3-Clause
#include "face_material.h"

#include <OgreGpuProgramParams.h>
#include <OgreHighLevelGpuProgram.h>
#include <OgreHighLevelGpuProgramManager.h>
#include <OgreMaterialManager.h>
#include <OgrePass.h>
#include <OgreResourceGroupManager.h>
#include <OgreTechnique.h>

#include <string>

namespace cuboid_mapping_rviz {
namespace {

// GLSL 1.20: what rviz can count on where Mesa draws.
constexpr const char* kVertexShader = R"(#version 120
uniform mat4 worldviewproj_matrix;
uniform mat4 worldview_matrix;
uniform vec4 group;  // least corner in the map frame, resolution
uniform float slice; // height of cross sections in the map frame
varying vec3 place;  // in cells from the least cell of the group
varying vec3 inward; // one cell into the cuboid
varying vec2 corner;
varying float light;
varying float changed;
varying float depth;
varying vec4 figures;

void main() {
  vec4 position = vec4(gl_Vertex.xyz, 1.0);
  float side = floor((gl_Vertex.w + 0.5) / 4.0);
  float number = gl_Vertex.w - 4.0 * side;
  corner = vec2(number > 0.5 && number < 2.5 ? 1.0 : 0.0, number > 1.5 ? 1.0 : 0.0);
  float upper = mod(side, 2.0) > 0.5 ? 1.0 : -1.0;
  vec3 normal = upper * (side < 1.5 ? vec3(1, 0, 0) : (side < 3.5 ? vec3(0, 1, 0) : vec3(0, 0, 1)));
  inward = -normal;
  vec3 normal_view = normalize(mat3(worldview_matrix) * normal);
  light = 0.55 + 0.25 * abs(normal_view.z) + 0.2 * abs(normal.z);
  place = position.xyz;
  if (side > 5.5) {  // A cross section: somewhere in the layer of its voxels.
    inward = vec3(0.0);
    place.z += 0.5;
    position.z = (slice - group.z) / group.w;
  }
  changed = gl_MultiTexCoord0.x;
  figures = gl_Color;
  depth = -(worldview_matrix * position).z;
  gl_Position = worldviewproj_matrix * position;
}
)";

/// Ahead of all fragment shaders: what of a face is shown.
constexpr const char* kClip = R"(#version 120
uniform vec4 group;  // least corner in the map frame, resolution
uniform vec3 min_clip;
uniform vec3 max_clip;
uniform float oldest;
varying vec3 place;
varying vec3 inward;
varying vec2 corner;
varying float light;
varying float changed;
varying float depth;
varying vec4 figures;

vec3 inMap() { return group.xyz + group.w * place; }
void clip() {
  vec3 p = inMap();
  if (any(lessThan(p, min_clip)) || any(greaterThan(p, max_clip)) || changed < oldest) discard;
}
)";

constexpr const char* kColors = R"(
uniform int mode;
uniform vec4 color;
uniform float edges;
uniform vec2 color_span;

vec3 rainbow(float ratio) {  // red, yellow, green, cyan, blue
  vec3 hue = abs(mod(4.0 * ratio + vec3(0.0, 4.0, 2.0), 6.0) - 3.0) - 1.0;
  return clamp(hue, 0.0, 1.0);
}

void main() {
  clip();
  vec3 shade = color.rgb;
  if (mode == 0) {
    float ratio = (inMap().z - color_span.x) / max(color_span.y - color_span.x, 1e-6);
    shade = rainbow(1.0 - clamp(ratio, 0.0, 1.0));
  } else if (mode == 1) {
    shade = mix(vec3(0.1, 0.7, 0.2), vec3(0.85, 0.1, 0.1), figures.r);
  } else if (mode == 2) {
    shade = rainbow(0.8 * (1.0 - figures.g));
  }
  vec2 pixels = min(corner, 1.0 - corner) / max(fwidth(corner), 1e-6);
  float line = edges * (1.0 - smoothstep(0.5, 1.5, min(pixels.x, pixels.y)));
  // Where a face is a few pixels wide, its edges would be all of it.
  line *= clamp(0.1 / max(max(fwidth(corner).x, fwidth(corner).y), 1e-6) - 0.3, 0.0, 1.0);
  gl_FragColor = vec4(mix(light * shade, 0.25 * shade, line), color.a);
}
)";

constexpr const char* kPick = R"(
uniform vec4 pick_color;
void main() {
  clip();
  gl_FragColor = vec4(pick_color.rgb, 1.0);
}
)";

/// The number of the voxel in its group, plus 1, as a colour.
constexpr const char* kPickVoxel = R"(
void main() {
  clip();
  vec3 cell = clamp(floor(place + 0.5 * inward), 0.0, 31.0);
  float number = cell.x + 32.0 * cell.y + 1024.0 * cell.z + 1.0;
  float high = floor(number / 256.0);
  gl_FragColor = vec4(0.0, high / 255.0, (number - 256.0 * high) / 255.0, 1.0);
}
)";

constexpr const char* kDepth = R"(
uniform float far_clip_distance;
void main() {
  clip();
  vec3 bytes = fract(depth / far_clip_distance * vec3(65536.0, 256.0, 1.0));
  bytes -= bytes.xxy * vec3(0.0, 1.0 / 256.0, 1.0 / 256.0);
  gl_FragColor = vec4(bytes.zyx, 1.0);
}
)";

constexpr const char* kGroup = "General";  // of Ogre: it is always there

/// Makes a program, once.
std::string program(const std::string& name, Ogre::GpuProgramType type, const std::string& source) {
  auto& manager = Ogre::HighLevelGpuProgramManager::getSingleton();
  std::string full_name = "cuboid_mapping/" + name;
  if (manager.resourceExists(full_name, kGroup)) return full_name;
  const Ogre::HighLevelGpuProgramPtr made = manager.createProgram(full_name, kGroup, "glsl", type);
  made->setSource(source);
  made->load();
  return full_name;
}

void setAuto(const Ogre::GpuProgramParametersSharedPtr& parameters, const char* name,
             Ogre::GpuProgramParameters::AutoConstantType type, std::size_t extra = 0) {
  parameters->setIgnoreMissingParams(true);
  parameters->setNamedAutoConstant(name, type, extra);
}

void addTechnique(Ogre::Material& material, const std::string& scheme, const std::string& name,
                  const std::string& fragment_source) {
  using Parameters = Ogre::GpuProgramParameters;
  Ogre::Technique* technique = material.createTechnique();
  technique->setSchemeName(scheme);
  technique->setName(name);
  Ogre::Pass* pass = technique->createPass();
  pass->setLightingEnabled(false);
  pass->setSceneBlending(Ogre::SBT_REPLACE);
  pass->setVertexProgram(program("faces.vert", Ogre::GPT_VERTEX_PROGRAM, kVertexShader));
  pass->setFragmentProgram(
      program(name + ".frag", Ogre::GPT_FRAGMENT_PROGRAM, kClip + fragment_source));
  const auto vertex = pass->getVertexProgramParameters();
  setAuto(vertex, "worldviewproj_matrix", Parameters::ACT_WORLDVIEWPROJ_MATRIX);
  setAuto(vertex, "worldview_matrix", Parameters::ACT_WORLDVIEW_MATRIX);
  setAuto(vertex, "group", Parameters::ACT_CUSTOM, kGroupParameter);
  const auto fragment = pass->getFragmentProgramParameters();
  setAuto(fragment, "group", Parameters::ACT_CUSTOM, kGroupParameter);
  setAuto(fragment, "pick_color", Parameters::ACT_CUSTOM, 2);  // PICK_COLOR_PARAMETER of rviz
  setAuto(fragment, "far_clip_distance", Parameters::ACT_FAR_CLIP_DISTANCE);
}

}  // namespace

FaceMaterial::FaceMaterial() {
  static int count = 0;
  material_ = Ogre::MaterialManager::getSingleton().create(
      "cuboid_mapping/faces" + std::to_string(count++), kGroup);
  material_->removeAllTechniques();
  addTechnique(*material_, Ogre::MaterialManager::DEFAULT_SCHEME_NAME, "colors", kColors);
  addTechnique(*material_, "Pick", "pick", kPick);
  addTechnique(*material_, "Pick1", "pick_voxel", kPickVoxel);
  addTechnique(*material_, "Depth", "depth", kDepth);
  material_->load();
  setStyle({});
}

FaceMaterial::~FaceMaterial() {
  Ogre::MaterialManager::getSingleton().remove(material_->getName(), kGroup);
}

void FaceMaterial::setStyle(const FaceStyle& style) {
  for (unsigned short i = 0; i < material_->getNumTechniques(); ++i) {
    Ogre::Pass* pass = material_->getTechnique(i)->getPass(0);
    const auto parameters = pass->getFragmentProgramParameters();
    parameters->setNamedConstant("min_clip", style.min_clip);
    parameters->setNamedConstant("max_clip", style.max_clip);
    parameters->setNamedConstant("oldest", style.oldest_s);
    parameters->setNamedConstant("mode", static_cast<int>(style.mode));
    Ogre::ColourValue color = style.color;
    color.a = style.alpha;
    parameters->setNamedConstant("color", color);
    parameters->setNamedConstant("edges", style.has_edges ? 1.0F : 0.0F);
    const float span[4] = {style.min_color_m, style.max_color_m, 0.0F, 0.0F};
    parameters->setNamedConstant("color_span", span, 1, 2);
    pass->getVertexProgramParameters()->setNamedConstant("slice", style.slice_m.value_or(0.0F));
    pass->setCullingMode(style.slice_m ? Ogre::CULL_NONE : Ogre::CULL_CLOCKWISE);
    if (i > 0) continue;
    const bool is_transparent = style.alpha < 0.9998F;
    pass->setSceneBlending(is_transparent ? Ogre::SBT_TRANSPARENT_ALPHA : Ogre::SBT_REPLACE);
    pass->setDepthWriteEnabled(!is_transparent);
  }
}

}  // namespace cuboid_mapping_rviz
