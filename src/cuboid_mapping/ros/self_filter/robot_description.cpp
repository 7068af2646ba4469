// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/self_filter/robot_description.h"

#include <geometric_shapes/bodies.h>
#include <geometric_shapes/body_operations.h>
#include <geometric_shapes/mesh_operations.h>
#include <geometric_shapes/shapes.h>
#include <urdf/model.h>

#include <memory>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using ShapePtr = std::unique_ptr<shapes::Shape>;

Eigen::Isometry3d toEigen(const urdf::Pose& pose) {
  const urdf::Rotation& q = pose.rotation;
  const Eigen::Translation3d position(pose.position.x, pose.position.y, pose.position.z);
  return position * Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
}

Eigen::Vector3d toEigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

/// @return Null for a mesh that cannot be read.
ShapePtr makeShape(const urdf::Geometry& geometry) {
  switch (geometry.type) {
    case urdf::Geometry::SPHERE:
      return std::make_unique<shapes::Sphere>(dynamic_cast<const urdf::Sphere&>(geometry).radius);
    case urdf::Geometry::BOX: {
      const auto size_m = toEigen(dynamic_cast<const urdf::Box&>(geometry).dim);
      return std::make_unique<shapes::Box>(size_m.x(), size_m.y(), size_m.z());
    }
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = dynamic_cast<const urdf::Cylinder&>(geometry);
      return std::make_unique<shapes::Cylinder>(cylinder.radius, cylinder.length);
    }
    case urdf::Geometry::MESH: break;
  }
  const auto& mesh = dynamic_cast<const urdf::Mesh&>(geometry);
  return ShapePtr(shapes::createMeshFromResource(mesh.filename, toEigen(mesh.scale)));
}

std::string fileOf(const urdf::Geometry& geometry) {
  const auto* mesh = dynamic_cast<const urdf::Mesh*>(&geometry);
  return mesh == nullptr ? "" : mesh->filename;
}

Solid makeSolid(const shapes::Shape& shape, const Eigen::Isometry3d& T_link_shape,
                double padding_m) {
  const std::shared_ptr<bodies::Body> body(bodies::createBodyFromShape(&shape));
  if (!body) throw std::runtime_error("has a shape of no volume");
  body->setPadding(padding_m);
  body->setPose(T_link_shape);
  bodies::AABB bounds;
  body->computeBoundingBox(bounds);
  return {{bounds.min(), bounds.max()},
          [body](const Eigen::Vector3d& point_link) { return body->containsPoint(point_link); }};
}

RobotPart makePart(const urdf::Link& link, const urdf::Collision& collision, double padding_m) {
  if (!collision.geometry) throw std::runtime_error("has a collision element without geometry");
  const ShapePtr shape = makeShape(*collision.geometry);
  if (!shape)
    throw std::runtime_error("has a mesh that cannot be read: " + fileOf(*collision.geometry));
  const Eigen::Isometry3d T_link_shape = toEigen(collision.origin);
  return {link.name, makeSolid(*shape, T_link_shape, padding_m),
          makeSolid(*shape, T_link_shape, 0.0)};
}

}  // namespace

bool canReadRobotDescriptions() { return true; }

RobotParts readRobotDescription(const std::string& urdf, double padding_m,
                                const std::set<std::string>& ignored_links) {
  urdf::Model model;
  if (!model.initString(urdf)) throw std::runtime_error("the robot description is no URDF");
  for (const std::string& name : ignored_links) {
    if (!model.getLink(name))
      throw std::runtime_error("the robot has no link " + name + " to ignore");
  }
  RobotParts parts;
  for (const auto& [name, link] : model.links_) {
    if (ignored_links.count(name) > 0) continue;
    try {
      for (const auto& collision : link->collision_array) {
        parts.push_back(makePart(*link, *collision, padding_m));
      }
    } catch (const std::exception& error) {
      throw std::runtime_error("link " + name + " of the robot " + error.what() +
                               "; correct it, or ignore the link");
    }
  }
  if (parts.empty()) throw std::runtime_error("the robot description has no collision shapes");
  return parts;
}

}  // namespace cuboid_mapping_ros
