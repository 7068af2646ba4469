// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/edits/map_edits.h"

#include "cuboid_mapping/ros/middleware/names.h"

namespace cuboid_mapping_ros {

MapEdits::MapEdits(const MapHost& host) {
  const ros::NodeHandle& nh = host.services_nh;
  servers_ = {offerAnswers<GetLocks>(nh, kGetLocksService, host.map_in_frame),
              offerService<SetBox>(nh, kSetBoxService,
                                   [&host](const auto& request, auto& response) {
                                     response = answer<SetBox>(host.map_in_frame, request);
                                     if (response.info.success != 0) host.publish_soon();
                                   }),
              offerService<std_srvs::Trigger>(nh, kUndoEditService,
                                              [&host](const auto& /*request*/, auto& response) {
                                                response = undoEdit(host.map);
                                                if (response.success != 0) host.publish_soon();
                                              })};
}

}  // namespace cuboid_mapping_ros
