// SPDX-License-Identifier: BSD-3-Clause
// Parameters that can be changed while the node runs. Pure functions; the messages are those of
// dynamic_reconfigure, made from the one table of parameters.
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>

#include <xmlrpcpp/XmlRpcValue.h>

#include <map>
#include <string>

namespace cuboid_mapping_ros {

/// The name of a parameter in dynamic_reconfigure, which takes no slashes: "sensor_model/hit" is
/// "sensor_model_hit".
[[nodiscard]] std::string toReconfigureName(const std::string& key);

/// Parameters that can be changed, with type, range, default and help. resolution and frame_id are in it, too,
/// so that somebody who tries to change them learns why not.
[[nodiscard]] dynamic_reconfigure::ConfigDescription describeConfig();

/// The values in force. -1 stands for no limit, as in the parameters.
[[nodiscard]] dynamic_reconfigure::Config toConfig(const NodeParameters& parameters);

/// Parameters that can be changed, by key, as the parameter server holds them.
[[nodiscard]] std::map<std::string, XmlRpc::XmlRpcValue> runtimeValues(
    const NodeParameters& parameters);

/// The parameters with the values of a request; those that it does not name stay.
///
/// A request counts as a whole: with any error nothing of it does. Errors: a name that does not
/// exist, a value that is refused at the start of the node, too, and a change of what is fixed
/// while the node runs (naming the reason).
[[nodiscard]] LoadedParameters applyConfig(const NodeParameters& parameters,
                                           const dynamic_reconfigure::Config& request);

}  // namespace cuboid_mapping_ros
