// SPDX-License-Identifier: BSD-3-Clause
#include "face_material.h"

#include <OgreGpuProgramParams.h>
#include <OgreHighLevelGpuProgram.h>
#include <OgreHighLevelGpuProgramManager.h>
#include <OgreMaterialManager.h>
#include <OgrePass.h>
#include <OgreResourceGroupManager.h>
#include <OgreTechnique.h>

#include <algorithm>
#include <array>
#include <string>

namespace cuboid_mapping_rviz {
namespace {

// GLSL 1.20: rviz can rely on this version with Mesa.
constexpr const char* kVertexShader = R"(#version 120
uniform mat4 worldviewproj_matrix;
uniform mat4 worldview_matrix;
uniform vec4 chunk;  // least corner in the map frame, resolution
uniform float slice; // height of cross sections in the map frame
uniform vec2 color_scale;  // least height, color ranges a metre
uniform float sinking;  // voxels that a face is shown too high, for a size of 1
varying vec3 place;  // in cells from the chunk
varying vec3 inward; // one cell into the cuboid
varying vec2 corner;
varying float light;
varying float changed;
varying float depth;
varying vec4 figures;
varying float hue;  // for the height

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
    position.z = (slice - chunk.z) / chunk.w;
  }
  changed = gl_MultiTexCoord0.x;
  figures = gl_Color;
  float height = chunk.z + chunk.w * (place.z - sinking * figures.g);
  hue = 4.0 - 4.0 * (height - color_scale.x) * color_scale.y;
  depth = -(worldview_matrix * position).z;
  gl_Position = worldviewproj_matrix * position;
}
)";

/// Common start of all fragment shaders: decides whether a fragment is shown.
constexpr const char* kClip = R"(
uniform vec4 chunk;  // least corner in the map frame, resolution
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
varying float hue;

void clip() {
  // A face in the plane of a cut is cut like its cuboid.
  vec3 p = chunk.xyz + chunk.w * (place + 0.001 * inward);
  if (any(lessThan(p, min_clip)) || any(greaterThan(p, max_clip)) || changed < oldest) discard;
}
)";

/// Fragment shader with the macros MODE, and optionally EDGES, CLIPPED and CAPPED: fewer macros are faster in
/// software. The preprocessor of Ogre 1.9 knows no #elif.
constexpr const char* kColors = R"(
uniform vec4 color;

vec3 rainbow(float hue) {  // red, yellow, green, cyan, blue: 0 to 4
  return clamp(vec3(2.0 - hue, min(hue, 4.0 - hue), hue - 2.0), 0.0, 1.0);
}

void main() {
#ifdef CLIPPED
  clip();
#endif
#if MODE == 0
  vec3 shade = rainbow(hue);
#endif
#if MODE == 1
  vec3 shade = mix(vec3(0.1, 0.7, 0.2), vec3(0.85, 0.1, 0.1), figures.r);
#endif
#if MODE == 2
  vec3 shade = rainbow(3.2 * (1.0 - figures.g));
#endif
#if MODE == 3
  vec3 shade = color.rgb;
#endif
#ifdef CAPPED
  if (!gl_FrontFacing) {  // Seen through a cut from inside: what is cut looks solid.
    gl_FragColor = vec4(mix(vec3(0.3), shade, 0.35), color.a);
    return;
  }
#endif
#ifdef EDGES
  vec2 width = 1.0 / max(fwidth(corner), 1e-6);  // of the face, in pixels
  vec2 pixels = min(corner, 1.0 - corner) * width;
  float line = clamp(1.5 - min(pixels.x, pixels.y), 0.0, 1.0);
  // Where a face is a few pixels wide, its edges would be all of it.
  line *= clamp(0.1 * min(width.x, width.y) - 0.3, 0.0, 1.0);
  gl_FragColor = vec4(mix(light, 0.25, line) * shade, color.a);
#else
  gl_FragColor = vec4(light * shade, color.a);
#endif
}
)";

constexpr const char* kPick = R"(
uniform vec4 pick_color;
void main() {
  clip();
  gl_FragColor = vec4(pick_color.rgb, 1.0);
}
)";

/// The number of the voxel in its chunk, plus 1, as a colour.
constexpr const char* kPickVoxel = R"(
void main() {
  clip();
  vec3 cell = clamp(floor(place + 0.5 * inward), 0.0, 63.0);
  float number = cell.x + 64.0 * cell.y + 4096.0 * cell.z + 1.0;
  vec3 digits = mod(floor(number / vec3(65536.0, 256.0, 1.0)), 256.0);
  gl_FragColor = vec4(digits / 255.0, 1.0);
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
  if (manager.getByName(full_name, kGroup).get() != nullptr) return full_name;
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

/// @param macros  "#define" lines before the source.
void setFragmentShader(Ogre::Pass& pass, const std::string& name, const std::string& source,
                       const std::string& macros = "") {
  using Parameters = Ogre::GpuProgramParameters;
  const std::string program_name = program(name + ".frag", Ogre::GPT_FRAGMENT_PROGRAM,
                                           "#version 120\n" + macros + kClip + source);
  if (pass.getFragmentProgramName() == program_name) return;
  pass.setFragmentProgram(program_name);
  const auto parameters = pass.getFragmentProgramParameters();
  setAuto(parameters, "chunk", Parameters::ACT_CUSTOM, kChunkParameter);
  setAuto(parameters, "pick_color", Parameters::ACT_CUSTOM, 2);  // PICK_COLOR_PARAMETER of rviz
  setAuto(parameters, "far_clip_distance", Parameters::ACT_FAR_CLIP_DISTANCE);
}

Ogre::Pass* addPass(Ogre::Material& material, const std::string& scheme) {
  using Parameters = Ogre::GpuProgramParameters;
  Ogre::Technique* technique = material.createTechnique();
  technique->setSchemeName(scheme);
  technique->setName(scheme);
  Ogre::Pass* pass = technique->createPass();
  pass->setLightingEnabled(false);
  pass->setSceneBlending(Ogre::SBT_REPLACE);
  pass->setVertexProgram(program("faces.vert", Ogre::GPT_VERTEX_PROGRAM, kVertexShader));
  const auto parameters = pass->getVertexProgramParameters();
  setAuto(parameters, "worldviewproj_matrix", Parameters::ACT_WORLDVIEWPROJ_MATRIX);
  setAuto(parameters, "worldview_matrix", Parameters::ACT_WORLDVIEW_MATRIX);
  setAuto(parameters, "chunk", Parameters::ACT_CUSTOM, kChunkParameter);
  return pass;
}

bool isCut(const FaceStyle& style) {
  const FaceStyle whole;
  return style.min_clip != whole.min_clip || style.max_clip != whole.max_clip;
}

bool isClipped(const FaceStyle& style) {
  return isCut(style) || style.oldest_s != FaceStyle().oldest_s;
}

/// Whether the inside of cuboids is drawn at cuts.
bool isCapped(const FaceStyle& style) {
  return isCut(style) && !style.slice_m && !isTransparent(style);
}

/// Chooses the shader for a style; compiles it when it is first needed.
void setColorShader(Ogre::Pass& pass, const FaceStyle& style) {
  const std::string mode = std::to_string(static_cast<int>(style.mode));
  std::string name = "colors" + mode;
  std::string macros = "#define MODE " + mode + "\n";
  const auto add = [&](bool is_wanted, const char* macro) {
    if (!is_wanted) return;
    name += std::string("_") + macro;
    macros += std::string("#define ") + macro + "\n";
  };
  add(style.has_edges && !style.is_coarse, "EDGES");
  add(isClipped(style), "CLIPPED");
  add(isCapped(style), "CAPPED");
  setFragmentShader(pass, name, kColors, macros);
}

void setVertexParameters(Ogre::Pass& pass, const FaceStyle& style) {
  const auto parameters = pass.getVertexProgramParameters();
  parameters->setNamedConstant("slice", style.slice_m.value_or(0.0F));
  const float range_m = std::max(style.max_color_m - style.min_color_m, 1e-6F);
  const std::array<float, 4> scale{style.min_color_m, 1.0F / range_m, 0.0F, 0.0F};
  parameters->setNamedConstant("color_scale", scale.data(), 1, 2);
  // The size of a vertex of a coarse face is its height above the voxels, in eighths of a voxel.
  parameters->setNamedConstant("sinking", style.is_coarse ? 255.0F / 8.0F : 0.0F);
}

}  // namespace

bool isTransparent(const FaceStyle& style) { return style.alpha < 0.9998F; }

bool hasTwoSides(const FaceStyle& style) { return style.slice_m || isCapped(style); }

FaceMaterial::FaceMaterial() {
  static int count = 0;
  material_ = Ogre::MaterialManager::getSingleton().create(
      "cuboid_mapping/faces" + std::to_string(count++), kGroup);
  material_->removeAllTechniques();
  setColorShader(*addPass(*material_, Ogre::MaterialManager::DEFAULT_SCHEME_NAME), {});
  setFragmentShader(*addPass(*material_, "Pick"), "pick", kPick);
  setFragmentShader(*addPass(*material_, "Pick1"), "pick_voxel", kPickVoxel);
  setFragmentShader(*addPass(*material_, "Depth"), "depth", kDepth);
  material_->load();
  setStyle({});
}

FaceMaterial::~FaceMaterial() {
  Ogre::MaterialManager::getSingleton().remove(material_->getHandle());
}

void FaceMaterial::setStyle(const FaceStyle& style) {
  setColorShader(*material_->getTechnique(0)->getPass(0), style);
  material_->load();
  for (unsigned short i = 0; i < material_->getNumTechniques(); ++i) {
    Ogre::Pass* pass = material_->getTechnique(i)->getPass(0);
    const auto parameters = pass->getFragmentProgramParameters();
    parameters->setNamedConstant("min_clip", style.min_clip);
    parameters->setNamedConstant("max_clip", style.max_clip);
    parameters->setNamedConstant("oldest", style.oldest_s);
    Ogre::ColourValue color = style.color;
    color.a = style.alpha;
    parameters->setNamedConstant("color", color);
    setVertexParameters(*pass, style);
    pass->setCullingMode(hasTwoSides(style) ? Ogre::CULL_NONE : Ogre::CULL_CLOCKWISE);
    if (i > 0) continue;
    const bool is_transparent = isTransparent(style);
    pass->setSceneBlending(is_transparent ? Ogre::SBT_TRANSPARENT_ALPHA : Ogre::SBT_REPLACE);
    pass->setDepthWriteEnabled(!is_transparent);
  }
}

}  // namespace cuboid_mapping_rviz
