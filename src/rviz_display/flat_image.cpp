// SPDX-License-Identifier: BSD-3-Clause
#include "flat_image.h"

#include <OgreDataStream.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>

#include <string>

namespace cuboid_mapping_rviz {
namespace {

const std::string kImageGroup = Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME;

}  // namespace

FlatImage::FlatImage(Ogre::SceneNode& parent)
    : node_(*parent.createChildSceneNode()), plane_(*parent.getCreator()->createManualObject()) {
  static int count = 0;
  material_ = Ogre::MaterialManager::getSingleton().create(
      "cuboid_mapping/image" + std::to_string(count++), kImageGroup);
  Ogre::Pass* pass = material_->getTechnique(0)->getPass(0);
  pass->setLightingEnabled(false);
  pass->setSceneBlending(Ogre::SBT_TRANSPARENT_ALPHA);
  pass->setDepthWriteEnabled(false);
  pass->setDepthBias(1.0F, 1.0F);  // In front of faces of cuboids in the same plane.
  pass->setCullingMode(Ogre::CULL_NONE);
  pass->createTextureUnitState()->setTextureFiltering(Ogre::TFO_NONE);
  node_.attachObject(&plane_);
}

FlatImage::~FlatImage() {
  Ogre::SceneManager* scene = node_.getCreator();
  scene->destroyManualObject(&plane_);
  scene->destroySceneNode(&node_);
  Ogre::MaterialManager::getSingleton().remove(material_->getHandle());
  removeTexture();
}

void FlatImage::removeTexture() {
  if (texture_.get() == nullptr) return;
  Ogre::TextureManager::getSingleton().remove(texture_->getHandle());
}

void FlatImage::show(const std::vector<Pixel>& pixels, std::size_t width,
                     const Ogre::Vector3& corner, float pixel_m) {
  auto& textures = Ogre::TextureManager::getSingleton();
  removeTexture();
  const std::size_t height = pixels.size() / width;
  std::vector<Pixel> copy = pixels;  // Ogre takes only pointers to writable memory.
  Ogre::DataStreamPtr stream(
      OGRE_NEW Ogre::MemoryDataStream(copy.data(), sizeof(Pixel) * copy.size()));
  texture_ = textures.loadRawData(
      material_->getName(), kImageGroup, stream, static_cast<Ogre::ushort>(width),
      static_cast<Ogre::ushort>(height), Ogre::PF_BYTE_RGBA, Ogre::TEX_TYPE_2D, 0);
  material_->getTechnique(0)->getPass(0)->getTextureUnitState(0)->setTextureName(
      texture_->getName());
  node_.setPosition(corner);
  plane_.clear();
  plane_.begin(material_->getName(), Ogre::RenderOperation::OT_TRIANGLE_STRIP, kImageGroup);
  for (const float y : {0.0F, 1.0F}) {
    for (const float x : {0.0F, 1.0F}) {
      plane_.position(x * pixel_m * static_cast<float>(width),
                      y * pixel_m * static_cast<float>(height), 0.0F);
      plane_.textureCoord(x, y);
    }
  }
  plane_.end();
}

}  // namespace cuboid_mapping_rviz
