// SPDX-License-Identifier: BSD-3-Clause
// Answers whether a body meets obstacles.
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/pose_query.h"
#include "cuboid_mapping/ros/services/answers.h"

namespace cuboid_mapping_ros {
namespace {

static_assert(CheckPoses::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(CheckPoses::Response::FREE == static_cast<int>(Occupancy::kFree));

constexpr Entries kPoses{"poses", 30};
constexpr Entries kSpheres{"spheres", 32};
constexpr Entries kBodyBoxes{"boxes", 80};

void requireAsMany(const char* parts, std::size_t num_parts, const char* sizes,
                   std::size_t num_sizes) {
  if (num_parts == num_sizes) return;
  throw Refusal("there are " + std::to_string(num_parts) + ' ' + parts + " and " +
                std::to_string(num_sizes) + ' ' + sizes + ": give one for each");
}

void requireGood(const Body& body, const ServiceCall& call) {
  const std::string fault = findFault(body, call.map().grid());
  if (!fault.empty()) throw Refusal(fault);
}

Body readBody(const ServiceCall& call, const CheckPoses::Request& request) {
  call.requireFew(request.spheres.size(), kSpheres);
  call.requireFew(request.boxes.size(), kBodyBoxes);
  requireAsMany("spheres", request.spheres.size(), "radii", request.radii.size());
  requireAsMany("boxes", request.boxes.size(), "sizes", request.sizes.size());
  const double inflation_m = ServiceCall::notNegative(request.inflation, "inflation");
  Body body;
  for (std::size_t i = 0; i < request.spheres.size(); ++i) {
    body.spheres.push_back({toVector(request.spheres[i]), request.radii[i]});
  }
  for (std::size_t i = 0; i < request.boxes.size(); ++i) {
    const geometry_msgs::Vector3& size = request.sizes[i];
    body.boxes.push_back(
        {ServiceCall::localPose(request.boxes[i], {"boxes", i}), {size.x, size.y, size.z}});
  }
  requireGood(body, call);  // Inflation hides an invalid size.
  for (auto& sphere : body.spheres) sphere.radius_m += inflation_m;
  for (auto& box : body.boxes) box.size_m.array() += 2.0 * inflation_m;
  requireGood(body, call);
  return body;
}

}  // namespace

void answer(ServiceCall& call, const CheckPoses::Request& request, CheckPoses::Response& response) {
  const auto policy = ServiceCall::policy(request.unknown);
  const Body body = readBody(call, request);
  const Eigen::Vector3d around_m = Eigen::Vector3d::Constant(2.0 * reachOf(body));
  call.requireFew(request.poses.size(), kPoses);
  std::vector<Eigen::Isometry3d> poses;
  for (const geometry_msgs::Pose& pose : request.poses) {
    poses.push_back(call.pose(pose, {"poses", poses.size()}));
    const Eigen::Vector3d center_map = poses.back().translation();
    call.requireCells(boxAround(center_map, around_m));
    response.point.push_back(toPoint(center_map));
  }
  response.free.assign(poses.size(), static_cast<std::uint8_t>(false));
  response.part.assign(poses.size(), -1);
  response.occupancy.assign(poses.size(), CheckPoses::Response::UNKNOWN);
  call.readEach(kPoses, poses.size(), [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto result = checkPoses(map, body, {poses[i]}, policy, budget).front();
    if (budget.isSpent()) return;
    response.free[i] = static_cast<std::uint8_t>(result.isFree());
    response.occupancy[i] = CheckPoses::Response::FREE;
    if (!result.contact) return;
    const Cell& voxel = result.contact->voxel;
    response.part[i] = static_cast<std::int32_t>(result.contact->part);
    response.point[i] = toPoint(map.grid().centerOf(CellBox::ofCell(voxel)));
    response.occupancy[i] = static_cast<std::uint8_t>(map.voxels().at(voxel));
  });
}

}  // namespace cuboid_mapping_ros
