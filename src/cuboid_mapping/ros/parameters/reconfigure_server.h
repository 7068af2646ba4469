// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>

#include <functional>

namespace cuboid_mapping_ros {

/// The server side of dynamic_reconfigure: ~set_parameters, ~parameter_descriptions and
/// ~parameter_updates, for rqt_reconfigure, dynparam and the client libraries.
///
/// This is own code because dynamic_reconfigure::Server clamps bad values instead of refusing the request, leaves names without
/// slashes on the parameter server, waits for a master that is gone, and needs each parameter declared again.
/// Thread rule: the service is answered on the queue of the node handle. The master, which may be gone,
/// gets the new values in a thread of its own.
class ReconfigureServer {
 public:
  /// @param apply  Called with all parameters after each request that has changed some.
  ReconfigureServer(const ros::NodeHandle& private_nh, const NodeParameters& parameters,
                    std::function<void(const NodeParameters&)> apply);
  ~ReconfigureServer();
  ReconfigureServer(const ReconfigureServer&) = delete;
  ReconfigureServer& operator=(const ReconfigureServer&) = delete;

 private:
  void onRequest(const dynamic_reconfigure::ReconfigureRequest& request,
                 dynamic_reconfigure::ReconfigureResponse& response);

  void tellMaster();

  ros::NodeHandle private_nh_;
  NodeParameters parameters_;
  std::function<void(const NodeParameters&)> apply_;
  ros::Publisher descriptions_;
  ros::Publisher updates_;
  ros::ServiceServer server_;
  GuardedThread master_thread_;
};

}  // namespace cuboid_mapping_ros
