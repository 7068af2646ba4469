// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/tf_poses.h"

#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/mapping/sensor_step.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <tf2/exceptions.h>
#include <boost/algorithm/string/predicate.hpp>

#include <algorithm>
#include <exception>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// A frame, such as a link of a URDF, or if tf does not know it that with a prefix: the one of the cloud's frame, or else
/// the only one, as in "robot1/arm".
std::string findPrefixed(const tf2::BufferCore& tf, const std::string& frame_id,
                         const std::string& cloud_frame_id) {
  if (tf._frameExists(withoutSlash(frame_id))) return frame_id;
  const std::string ending = '/' + withoutSlash(frame_id);
  std::string beside = cloud_frame_id.substr(0, cloud_frame_id.rfind('/')) + ending;
  if (tf._frameExists(beside)) return beside;
  std::vector<std::string> known;
  tf._getFrameStrings(known);
  const auto is_other = [&ending](const std::string& name) {
    return !boost::algorithm::ends_with(name, ending);
  };
  known.erase(std::remove_if(known.begin(), known.end(), is_other), known.end());
  return known.size() == 1 ? known.front() : frame_id;
}

std::string describeGap(const TfGap& gap) {
  return "tf has no transform of '" + gap.frame_id + "' for " +
         describeAge(gap.end_s - gap.begin_s);
}

/// The poses at a time; otherwise the cause in the search.
std::optional<CloudPoses> lookupAt(const TfBuffer& tf, const PoseFrames& frames,
                                   const std::string& cloud_frame_id, const ros::Time& stamp,
                                   PoseSearch& search) {
  bool is_complete = true;
  const auto lookup_in = [&](const std::string& target, const std::string& frame_id) {
    const TfLookup result = lookupTransform(tf, target, frame_id, stamp);
    if (is_complete && !result.T_target_source) {
      search.why = result.error;
      is_complete = false;
    } else if (const auto gap = is_complete ? tf.findGap(target, frame_id, stamp) : std::nullopt) {
      search.why = describeGap(*gap);
      search.hopeless = DropReason::kTfGap;
      is_complete = false;
    }
    return result.T_target_source.value_or(Eigen::Isometry3d::Identity());
  };
  /// @param cure  Where to look if tf does not have the frame.
  const auto lookup = [&](const std::string& frame_id, const std::string& cure = "") {
    const bool was_complete = is_complete;
    Eigen::Isometry3d T_map_frame = lookup_in(frames.map, frame_id);
    if (was_complete && !is_complete && !cure.empty()) search.why += " (" + cure + ')';
    return T_map_frame;
  };
  CloudPoses poses;
  poses.T_map_cloud = lookup(cloud_frame_id);
  poses.T_map_sensor =
      frames.sensor.empty() ? poses.T_map_cloud : lookup(frames.sensor, "sensor_frame");
  if (frames.has_body) {
    const std::string& body = frames.body.empty() ? cloud_frame_id : frames.body;
    const std::string& sensor = frames.sensor.empty() ? cloud_frame_id : frames.sensor;
    poses.body = BodyPoses{lookup(body, frames.body.empty() ? "" : "keep_clouds/body_frame"),
                           lookup_in(body, cloud_frame_id), lookup_in(body, sensor)};
  }
  if (!frames.window.empty()) {
    poses.window_center_map = lookup(frames.window, "window/frame").translation();
  }
  for (const StepFrame& frame : frames.steps) {
    poses.T_map_steps.push_back(lookup(frame.frame_id, frame.cure));
  }
  if (!is_complete) return std::nullopt;
  return poses;
}

/// View of a slice from the body's pose at the stamp of the cloud.
BodyPoses seenFrom(const BodyPoses& at_stamp, const CloudPoses& slice) {
  const Eigen::Isometry3d T_body_map = at_stamp.T_map_body.inverse();
  return {at_stamp.T_map_body, T_body_map * slice.T_map_cloud, T_body_map * slice.T_map_sensor};
}

/// Stamp of the newest transform between a frame and the map; 0 if all are static. @throws Exceptions of tf.
double newestStamp_s(const tf2::BufferCore& tf, const std::string& map_frame_id,
                     const std::string& frame_id) {
  const std::string source = withoutSlash(frame_id);
  const std::string target = withoutSlash(map_frame_id);
  if (source == target) return 0.0;
  return tf.lookupTransform(target, source, ros::Time()).header.stamp.toSec();
}

/// Time by which a cloud is later than the newest transform of one of its frames.
struct Lead {
  std::string frame_id;
  double lead_s = 0.0;
};

std::string describeNoCommonTime(const std::string& frame_id, const std::string& map_frame_id) {
  return "the transforms between '" + withoutSlash(frame_id) + "' and '" +
         withoutSlash(map_frame_id) +
         "' have no time in common: the clock of a publisher is wrong, or it has stopped. rosrun "
         "tf2_tools view_frames.py shows the times of each";
}

/// The greatest lead; nothing if all transforms are static, or tf does not connect the frames, or at no time.
std::optional<Lead> findLead(const tf2::BufferCore& tf, const PoseFrames& frames,
                             const std::string& cloud_frame_id, double stamp_s,
                             PoseSearch& search) {
  std::vector<std::string> frame_ids = frames.needed();
  frame_ids.push_back(cloud_frame_id);
  std::optional<Lead> greatest;
  for (const std::string& frame_id : frame_ids) {
    try {
      const double newest_s = newestStamp_s(tf, frames.map, frame_id);
      if (newest_s == 0.0) continue;
      if (!greatest || stamp_s - newest_s > greatest->lead_s) {
        greatest = Lead{withoutSlash(frame_id), stamp_s - newest_s};
      }
    } catch (const tf2::ExtrapolationException&) {
      search.why = describeNoCommonTime(frame_id, frames.map);
      search.names_cure = true;
      return std::nullopt;
    } catch (const std::exception&) {
      return std::nullopt;  // The frames are not connected, now.
    }
  }
  return greatest;
}

std::string describeLead(const Lead& lead, const std::string& map_frame_id) {
  return "the newest transform from '" + lead.frame_id + "' to '" + withoutSlash(map_frame_id) +
         "' is " + describeAge(lead.lead_s) + " older than the cloud";
}

/// findPoses() without the cause in terms of time.
PoseSearch lookupPoses(const TfBuffer& tf, const PoseFrames& frames, const std_msgs::Header& header,
                       const Slices& slices) {
  PoseSearch search;
  auto poses = lookupAt(tf, frames, header.frame_id, header.stamp, search);
  if (!poses) return search;
  // The last slice first: tf may not have it yet.
  for (auto slice = slices.rbegin(); slice != slices.rend(); ++slice) {
    auto slice_poses =
        lookupAt(tf, frames, header.frame_id, header.stamp + middleOf(*slice), search);
    if (!slice_poses) return search;
    if (poses->body) slice_poses->body = seenFrom(*poses->body, *slice_poses);
    poses->slice_poses.push_back(*std::move(slice_poses));
  }
  std::reverse(poses->slice_poses.begin(), poses->slice_poses.end());
  poses->slices = slices;
  search.poses = std::move(poses);
  return search;
}

}  // namespace

ros::Duration middleOf(std::int32_t slice) {
  ros::Duration middle;
  middle.fromNSec(slice * kSliceNanoseconds + kSliceNanoseconds / 2);
  return middle;
}

PoseFrames::PoseFrames(const NodeParameters& parameters, const SourceParameters& source)
    : map(parameters.frame_id),
      sensor(source.sensor_frame),
      window(parameters.window.frame_id),
      has_body(parameters.keep.isOn()),
      body(has_body ? parameters.keep.body_frame : "") {
  for (const auto& step : makeSteps(parameters, source)) {
    for (StepFrame& frame : step->frames()) steps.push_back(std::move(frame));
  }
}

std::vector<std::string> PoseFrames::needed() const {
  std::vector<std::string> frame_ids;
  for (const StepFrame& frame : steps) frame_ids.push_back(frame.frame_id);
  for (const std::string& frame_id : {sensor, window, body}) {
    if (!frame_id.empty()) frame_ids.push_back(frame_id);
  }
  return frame_ids;
}

PoseSearch findPoses(const TfBuffer& tf, const PoseFrames& given, const std_msgs::Header& header,
                     const Slices& slices) {
  PoseFrames frames = given;
  for (StepFrame& frame : frames.steps) {
    frame.frame_id = findPrefixed(tf, frame.frame_id, withoutSlash(header.frame_id));
  }
  PoseSearch search = lookupPoses(tf, frames, header, slices);
  if (search.poses || search.hopeless || header.stamp.isZero()) return search;
  const double last_s = slices.empty() ? 0.0 : middleOf(slices.back()).toSec();
  const auto lead = findLead(tf, frames, header.frame_id, header.stamp.toSec() + last_s, search);
  if (lead && lead->lead_s > 0.0) {
    search.why = describeLead(*lead, frames.map);
  } else if (lead) {
    search = lookupPoses(tf, frames, header, slices);  // The transforms may have come just now.
    if (!search.poses && !search.hopeless) {
      search.hopeless = tf.covers(header.frame_id, header.stamp) ? DropReason::kNoTransform
                                                                 : DropReason::kBeforeTf;
    }
  }
  if (lead) search.lead_s = lead->lead_s;
  search.cache_s = tf.cache_s();
  const std::string faults = search.poses ? "" : tf.describeFaults(header.frame_id);
  if (!faults.empty()) {
    search.why = faults;
    search.names_cure = true;
  }
  return search;
}

}  // namespace cuboid_mapping_ros
