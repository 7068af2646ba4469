// SPDX-License-Identifier: BSD-3-Clause
#include "bag_clouds.h"

#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "stamps.h"
#include "transform_message.h"
#include "yaml_parameters.h"

#include <boost/make_shared.hpp>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <set>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Opens scan folders; nothing if the inputs are bags.
std::optional<ScanFolders> openFolders(const BagOptions& options) {
  const std::vector<std::string>& paths = options.inputs;
  const auto count = std::count_if(paths.begin(), paths.end(), ScanFolders::isOne);
  if (count == 0) return std::nullopt;
  if (static_cast<std::size_t>(count) < paths.size()) {
    throw std::runtime_error("rosbags and scan folders do not go together: map one kind of them");
  }
  return ScanFolders(paths, cuboid_mapping::parseBinRow(options.bin_row));
}

/// The parameters of the options, and the keys that were set.
struct OptionParameters {
  NodeParameters parameters;
  bool has_frame = false;
  bool has_type = false;
};

OptionParameters readOptionParameters(const std::string& program, const BagOptions& options) {
  const XmlRpc::XmlRpcValue given = loadYamlParameters(options.parameter_file, options.settings);
  const LoadedParameters loaded = readParameters(given);
  for (const ParameterError& warning : loaded.warnings) {
    std::cerr << program << ": parameter " << warning.key << ": " << warning.message << std::endl;
  }
  for (const ParameterError& error : loaded.errors) {
    std::cerr << program << ": parameter " << error.key << ": " << error.message << std::endl;
  }
  if (!loaded.errors.empty()) throw std::runtime_error("bad parameters");
  const auto has = [&given](const char* key) {
    return given.getType() == XmlRpc::XmlRpcValue::TypeStruct && given.hasMember(key);
  };
  return {loaded.parameters, has("frame_id"), has("type")};
}

/// @throws std::runtime_error  for options that need bags.
void checkForFolders(const NodeParameters& parameters, const BagOptions& options) {
  if (!options.topics.empty()) throw std::runtime_error("--topic does not go with scan folders");
  if (!options.tf.empty() || !options.transforms.empty()) {
    throw std::runtime_error("--tf and --transform do not go with scan folders");
  }
  if (!options.poses.empty()) {
    throw std::runtime_error("--poses does not go with scan folders: change their poses.txt");
  }
  if (!parameters.sources.empty() || parameters.source.type != SourceType::kPointCloud) {
    throw std::runtime_error("scan folders are one source of clouds: set no sources and no type");
  }
  if (parameters.source.max_rate_hz > 0.0) {
    throw std::runtime_error("scan folders have no stamps: set max_rate to 0");
  }
  if (withoutSlash(parameters.frame_id) == ScanNames().sensor_frame) {
    throw std::runtime_error("frame_id: this is the frame of the clouds of scan folders");
  }
}

/// Default name of a map: the name of its input.
std::string nameOutput(const std::string& input) {
  std::filesystem::path path(input);
  if (path.filename().empty()) path = path.parent_path();  // removes the slash of "folder/"
  const std::filesystem::path name = path.filename();
  return (std::filesystem::is_directory(path) ? name : name.stem()).string() + ".cuboids";
}

}  // namespace

std::optional<int> parseBagOptions(cuboid_mapping::CommandLine& line, int argc, char** argv,
                                   BagOptions& options) {
  line.addArgument("inputs", options.inputs,
                   "rosbags with messages of sensors and tf; or folders of scans with poses, or "
                   "OctoMap .graph files");
  line.addText("output,o", options.output,
               "map to write: " + cuboid_mapping::knownEndings() +
                   "; without it, NAME.cuboids in the working folder");
  line.addTexts("topic", options.topics,
                "topics of sensors; without it, all clouds, else all planar scans, else all depth "
                "images");
  line.addText("tf", options.tf,
               "topic of the transforms, such as /robot1/tf, which goes with /robot1/tf_static");
  line.addTexts("transform", options.transforms,
                "a static transform missing from the bags: \"parent child x y z yaw pitch "
                "roll\", metres and radians");
  line.addText(
      "poses", options.poses,
      "corrected poses, used instead of tf: a file with lines \"stamp x y z qx qy "
      "qz qw\", or a topic of the bags with a nav_msgs/Path, Odometry or PoseStamped. Clouds "
      "outside their time are left out");
  line.addText("poses-of", options.poses_of,
               "frame of these poses, such as base_link; default: the frame of the clouds, "
               "or the child frame of an Odometry");
  line.addText("bin-row", options.bin_row, cuboid_mapping::kBinRowHelp);
  line.addText("params", options.parameter_file,
               "YAML file with parameters of the node, such as config/default.yaml");
  line.addTexts(
      "set", options.settings,
      "a parameter as key=value: resolution=0.1, sensor_model/max_range=30; overrides --params");
  if (const auto status = line.parse(argc, argv)) return status;
  if (options.output.empty()) options.output = nameOutput(options.inputs.front());
  return std::nullopt;
}

BagClouds::BagClouds(std::string program, const BagOptions& options)
    : program_(std::move(program)),
      folders_(openFolders(options)),
      bags_(folders_ ? std::vector<std::string>() : options.inputs) {
  const OptionParameters read = readOptionParameters(program_, options);
  parameters_ = read.parameters;
  if (folders_) {
    checkForFolders(parameters_, options);
  } else {
    const BagTopics topics(bags_);
    transforms_.setMaxGap(parameters_.tf_gap_s);
    transforms_.read(bags_, topics, options.tf, options.transforms);
    say(transforms_.notes());
    readPoses(topics, options, read.has_frame);
    if (!poses_) transforms_.checkRuns(topics);
    if (!read.has_frame && !poses_) chooseFrame(topics);
    const ChosenSources chosen = chooseSources(topics, parameters_, read.has_type, options.topics);
    say(chosen.notes);
    parameters_ = chosen.parameters;
  }
  readReferences(parameters_, [](const std::string& /*name*/) -> std::optional<std::string> {
    throw std::runtime_error(
        "self_filter/robot_description: there is no parameter server here; name a .urdf file");
  });
  if (folders_) return;
  messages_.emplace(bags_, parameters_);
  if (messages_->numWithoutCamera() == 0) return;
  say({cuboid_mapping::counted(messages_->numWithoutCamera(), "depth image") +
       " left out, for which there is no camera_info"});
}

/// Chooses the default frame if there is no 'map': the root of the tree with all sensors.
void BagClouds::chooseFrame(const BagTopics& topics) {
  const tf2::BufferCore& tf = transforms_.buffer();
  if (tf._frameExists(withoutSlash(parameters_.frame_id))) return;
  std::set<std::string> roots;
  for (const auto& [name, topic] : topics.all()) {
    const auto root = topic.type ? findRoot(tf, topic.frame_id) : std::nullopt;
    if (root) roots.insert(*root);
  }
  if (roots.size() != 1) return;
  say({"there is no frame '" + parameters_.frame_id + "': maps in '" + *roots.begin() +
       "', the root of the transforms (as --set frame_id=" + *roots.begin() + " does)"});
  parameters_.frame_id = *roots.begin();
}

void BagClouds::readPoses(const BagTopics& topics, const BagOptions& options, bool has_frame) {
  if (options.poses.empty()) {
    if (options.poses_of.empty()) return;
    throw std::runtime_error("--poses-of needs poses: name them with --poses");
  }
  poses_ = readBagPoses(bags_, topics, options.poses, parameters_.tf_gap_s);
  if (!options.poses_of.empty()) poses_->body_frame_id = withoutSlash(options.poses_of);
  say({poses_->note});
  const std::string& frame_id = poses_->map_frame_id;
  if (frame_id.empty() || frame_id == withoutSlash(parameters_.frame_id)) return;
  if (has_frame) {
    throw std::runtime_error("the poses of " + options.poses + " are in the frame '" + frame_id +
                             "', but frame_id is '" + parameters_.frame_id +
                             "': set frame_id to the frame of the poses, or leave it out");
  }
  say({"maps in '" + frame_id + "', the frame of the poses"});
  parameters_.frame_id = frame_id;
}

void BagClouds::say(const std::vector<std::string>& lines) const {
  for (const std::string& line : lines) std::cerr << program_ << ": " << line << std::endl;
}

void BagClouds::setThreads(int threads) { parameters_.threads = threads; }

cuboid_mapping::SensorModel BagClouds::sensorModel(std::size_t source) const {
  return cuboid_mapping::SensorModel(sourcesOf(parameters_).at(source).sensor_model,
                                     parameters_.map.environment);
}

void BagClouds::walk(const CloudShare& share, const Take& take,
                     const cuboid_mapping::ProgressListener& listener) {
  sources_ = makeSources(parameters_);
  watch_.emplace(parameters_.map.resolution_m, parameters_.source.max_range_m, sources_.size());
  for (std::uint64_t number = share.begin; number < numClouds(); ++number) {
    cuboid_mapping::throwIfInterrupted();
    if (number % share.step == share.first) {
      if (!folders_) transforms_.advance(recorded_ = messages_->recorded(number));
      if (const auto cloud = read(number)) {
        walkOne(*cloud, take);
      } else {
        ++statistics_.num_received;
        take(nullptr, {});
      }
    }
    if (listener) listener(number + 1, numClouds());
  }
}

/// Reads a message. A scan sets its transform, too.
std::optional<SensorMessage> BagClouds::read(std::uint64_t number) {
  if (!folders_) return messages_->read(number);
  const cuboid_mapping::ScanDataset::Item scan = folders_->read(number);
  const ros::Time stamp = computeStamp(kFirstStamp, number, kScanRate_hz);
  const ScanNames names;
  transforms_.set(toTransformMessage(scan.T_map_sensor, stamp, withoutSlash(parameters_.frame_id),
                                     names.sensor_frame));
  return SensorMessage{boost::make_shared<sensor_msgs::PointCloud2>(
      toCloud(scan.points_sensor, makeHeader(names.sensor_frame, stamp)))};
}

void BagClouds::walkOne(const SensorMessage& cloud, const Take& take) {
  ++statistics_.num_received;
  if (cloud.header().stamp.isZero() && !std::exchange(has_named_stamps_, true)) {
    say({"warning: " + nameOf(sources_.at(cloud.source)->parameters) +
         ": clouds without a stamp are placed by the time of recording: have the driver set "
         "header.stamp"});
  }
  watch_->noteReceived(cloud.header().stamp.toSec(), cloud.source);
  Stopwatch stopwatch;
  Origin origin{cloud.header().stamp, cloud.source};
  const cuboid_mapping::ScanUpdate* update = compute(cloud, origin);
  take(update, origin);
  if (update == nullptr) return;
  watch_->noteInserted(1e-3 * stopwatch.lap(), statistics_.reach_m, cloud.source);
  suggestOnce();
}

const cuboid_mapping::ScanUpdate* BagClouds::compute(const SensorMessage& cloud, Origin& origin) {
  if (!hasFrame(cloud.header())) {
    leaveOut(DropReason::kEmptyFrame, toAdvice(DropReason::kEmptyFrame));
    return nullptr;
  }
  Source& source = *sources_.at(cloud.source);
  const PoseSearch search = findPosesOf(cloud, source);
  const auto& poses = search.poses;
  if (!poses) {
    const DropReason reason = search.hopeless.value_or(DropReason::kNoTransform);
    const bool is_gap = reason == DropReason::kTfGap;
    leaveOut(reason, is_gap ? search.why + ": " + toAdvice(reason) : search.why);
    return nullptr;
  }
  origin.sensor_map = poses->T_map_sensor.translation();
  origin.window_center_map = poses->window_center_map;
  const Observed observed = source.input.compute(cloud, *poses);
  for (const std::string& warning : source.input.takeWarnings()) {
    say({"warning: " + nameOf(source.parameters) + ": " + warning});
  }
  if (observed.error) {
    leaveOut(observed.error->defect, observed.error->text);
  } else {
    statistics_.addInserted(observed.figures);
  }
  return observed.update;
}

PoseSearch BagClouds::findPosesOf(const SensorMessage& cloud, const Source& source) const {
  const Slices slices = source.input.findSlices(cloud);
  const TfBuffer& tf = transforms_.buffer();
  std_msgs::Header header = cloud.header();
  // tf would give the newest transform, here that of the end of the bag.
  if (header.stamp.isZero()) header.stamp = recorded_;
  if (!poses_) return findPoses(tf, source.frames, header, slices);
  return findPosesOn(poses_->track, poses_->body_frame_id, tf, source.frames, header, slices);
}

/// Suggests settings after the first clouds, while a restart is cheap.
void BagClouds::suggestOnce() {
  if (statistics_.num_inserted != SpeedWatch::kFirstClouds) return;
  if (const auto suggestion = watch_->suggestion()) {
    std::cerr << program_ << ": " << *suggestion << std::endl;
  }
}

void BagClouds::leaveOut(DropReason reason, const std::string& text) {
  const auto i = static_cast<std::size_t>(reason);
  if (left_out_.counts[i]++ == 0) left_out_.first_texts[i] = text;
}

void BagClouds::report(const LeftOutClouds& left_out, const PointCounts& points) const {
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    if (left_out.counts[i] == 0) continue;
    std::cerr << program_ << ": " << cuboid_mapping::counted(left_out.counts[i], "cloud")
              << " dropped, " << toString(static_cast<DropReason>(i)) << ": "
              << left_out.first_texts[i] << std::endl;
  }
  if (points.num_odd_times > 0) {
    say({cuboid_mapping::counted(points.num_odd_times, "point") +
         " left out, whose time is not within the sweep of its cloud"});
  }
  constexpr std::uint64_t kNotable = 5;  ///< A fifth of the points.
  const std::uint64_t num_read = points.num_filtered + points.num_points;
  if (kNotable * points.num_filtered > num_read) {
    say({std::to_string(100 * points.num_filtered / num_read) +
         " % of the points left out by "
         "sensor_model/min_range, pointcloud_min_* and pointcloud_max_*"});
  }
  say(bags_.describeDamage());
}

}  // namespace cuboid_mapping_ros
