// SPDX-License-Identifier: BSD-3-Clause
// Bytes as they come over the network, as each message and request that the package takes.
#include "cuboid_mapping/CastRays.h"
#include "cuboid_mapping/CheckBoxes.h"
#include "cuboid_mapping/CheckPath.h"
#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/FullCuboidMap.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/ros/middleware/checked_messages.h"

#include <dynamic_reconfigure/Reconfigure.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>

#include <array>
#include <cstdlib>

namespace {

namespace ser = ros::serialization;
using Bytes = std::vector<std::uint8_t>;

/// What is read takes no more bytes than there are, and comes out again as it went in.
template <typename MessageT>
void read(Bytes bytes) {
  MessageT message;
  try {
    cuboid_mapping_ros::readChecked(bytes.data(), bytes.size(), message);
  } catch (const ser::StreamOverrunException&) {
    return;
  }
  const std::uint32_t size = ser::serializationLength(message);
  if (size > bytes.size()) std::abort();
  Bytes written(size);
  ser::OStream stream(written.data(), size);
  ser::serialize(stream, message);
  MessageT again;
  cuboid_mapping_ros::readChecked(written.data(), written.size(), again);
  if (ser::serializationLength(again) != size) std::abort();
}

constexpr std::array<void (*)(Bytes), 10> kReaders{read<sensor_msgs::PointCloud2>,
                                                   read<tf2_msgs::TFMessage>,
                                                   read<cuboid_mapping::FullCuboidMap>,
                                                   read<cuboid_mapping::CuboidMapUpdate>,
                                                   read<cuboid_mapping::GetMap::Response>,
                                                   read<cuboid_mapping::CheckPath::Request>,
                                                   read<cuboid_mapping::CheckBoxes::Request>,
                                                   read<cuboid_mapping::CastRays::Request>,
                                                   read<cuboid_mapping::SetBox::Request>,
                                                   read<dynamic_reconfigure::Reconfigure::Request>};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  kReaders[data[0] % kReaders.size()](Bytes(data + 1, data + size));
  return 0;
}
