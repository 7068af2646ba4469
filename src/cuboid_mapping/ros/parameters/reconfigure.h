// SPDX-License-Identifier: BSD-3-Clause
// Parameters that can be changed while the node runs: pure functions, which make the messages of
// dynamic_reconfigure from the one table of parameters, and the server.
#pragma once

#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace cuboid_mapping_ros {

/// Name of a parameter in dynamic_reconfigure, without slashes: "sensor_model/hit" becomes
/// "sensor_model_hit".
[[nodiscard]] std::string toReconfigureName(const std::string& key);

/// Parameters that can be changed, with type, range, default and help. resolution and frame_id are included,
/// so that a user who tries to change them learns why not.
[[nodiscard]] dynamic_reconfigure::ConfigDescription describeConfig();

/// The values in force. -1 stands for no limit, as in the parameters.
[[nodiscard]] dynamic_reconfigure::Config toConfig(const NodeParameters& parameters);

/// Parameters that can be changed, by key, in the form of the parameter server.
[[nodiscard]] std::map<std::string, XmlRpc::XmlRpcValue> runtimeValues(
    const NodeParameters& parameters);

/// The parameters with the values of a request; others stay.
///
/// A request with any error changes nothing. Errors: a name that does not
/// exist, a value that is refused at the start of the node, and a change of a parameter that is fixed
/// while the node runs (with the reason). Names that only octomap_server has are ignored.
[[nodiscard]] LoadedParameters applyConfig(const NodeParameters& parameters,
                                           const dynamic_reconfigure::Config& request);

/// The server side of dynamic_reconfigure: ~set_parameters, ~parameter_descriptions and
/// ~parameter_updates, for rqt_reconfigure, dynparam and the client libraries.
///
/// This is own code because dynamic_reconfigure::Server clamps bad values instead of refusing the request,
/// leaves names without slashes on the parameter server, waits for a master that is gone, and needs each
/// parameter declared again.
/// Thread rule: the queue of the node handle may have several threads. The answer does not wait for the
/// master, which may be gone.
class ReconfigureServer {
 public:
  /// @param apply  Called with all parameters after each request that has changed some.
  ReconfigureServer(const ros::NodeHandle& private_nh, const NodeParameters& parameters,
                    std::function<void(const NodeParameters&)> apply);
  ReconfigureServer(const ReconfigureServer&) = delete;
  ReconfigureServer& operator=(const ReconfigureServer&) = delete;

 private:
  void onRequest(const dynamic_reconfigure::ReconfigureRequest& request,
                 dynamic_reconfigure::ReconfigureResponse& response);

  void tellMaster();

  ros::NodeHandle private_nh_;
  std::mutex mutex_;         ///< Guards parameters_, and is held during a request.
  std::mutex master_mutex_;  ///< Held while values are written: the last ones last.
  NodeParameters parameters_;
  std::function<void(const NodeParameters&)> apply_;
  ros::Publisher descriptions_;
  ros::Publisher updates_;
  ros::ServiceServer server_;
};

}  // namespace cuboid_mapping_ros
