// SPDX-License-Identifier: BSD-3-Clause
#include "bag_files.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/text.h"

#include <ros/serialization.h>
#include <rosbag/view.h>
#include <std_msgs/Header.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace cuboid_mapping_ros {
namespace {

/// Raises the limit of open files for so many bags. @throws std::runtime_error if it cannot.
void allowOpenFiles(std::size_t num_bags) {
  constexpr std::size_t kOtherFiles = 64;
  rlimit limit{};
  const rlim_t wanted = num_bags + kOtherFiles;
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = std::min<rlim_t>(wanted, limit.rlim_max);
  (void)setrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_cur >= wanted) return;
  throw std::runtime_error(cuboid_mapping::counted(num_bags, "bag") + " are more than the " +
                           std::to_string(limit.rlim_max) +
                           " files that may be open: raise the limit (ulimit -n " +
                           std::to_string(wanted) +
                           "), or map some of them at a time, and merge the maps with map_merge");
}

std::unique_ptr<rosbag::Bag> openBag(const std::string& file) {
  const std::string subject = "cannot read " + file + " as a rosbag: ";
  if (access(file.c_str(), R_OK) != 0) throw std::runtime_error(subject + std::strerror(errno));
  cuboid_mapping::requireFile(file);
  if (!isRosbag(file)) {
    throw std::runtime_error(subject +
                             "it does not begin as those of ROS 1 do. rosbags-convert makes one of "
                             "a bag of ROS 2");
  }
  try {
    return std::make_unique<rosbag::Bag>(file);
  } catch (const rosbag::BagUnindexedException&) {
    throw std::runtime_error(subject +
                             "it has no index, since its recording was cut off. Make one "
                             "with: rosbag reindex " +
                             file);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(subject + error.what() +
                             ". If it is a damaged bag, try: rosbag reindex " + file);
  } catch (const std::exception& error) {
    throw std::runtime_error(subject + error.what());
  }
}

}  // namespace

bool isRosbag(const std::string& file) {
  constexpr char kMagic[] = "#ROSBAG V";
  std::string start(sizeof(kMagic) - 1, '\0');
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return false;  // A pipe would be waited for.
  std::ifstream(file, std::ios::binary)
      .read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == kMagic;
}

std::string withSlash(const std::string& topic) {
  return topic.empty() || topic.front() != '/' ? '/' + topic : topic;
}

BagFiles::BagFiles(const std::vector<std::string>& files) {
  allowOpenFiles(files.size());
  for (const std::string& file : files) {
    bags_.emplace_back();
    bags_.back().bag = openBag(file);
  }
}

std::vector<BagMessage> BagFiles::collect(const std::vector<std::string>& topics) const {
  std::vector<BagMessage> messages;
  for (std::size_t number = 0; number < bags_.size(); ++number) {
    rosbag::View view(*bags_[number].bag, rosbag::TopicQuery(topics));
    for (const rosbag::MessageInstance& instance : view) messages.push_back({number, instance});
  }
  // Each bag is in order. Instances cannot be assigned, so their order is sorted separately.
  std::vector<std::size_t> order(messages.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&messages](std::size_t a, std::size_t b) {
    return messages[a].instance.getTime() < messages[b].instance.getTime();
  });
  std::vector<BagMessage> sorted;
  sorted.reserve(messages.size());
  for (const std::size_t i : order) sorted.push_back(messages[i]);
  return sorted;
}

ros::Time BagFiles::readStamp(const BagMessage& message) {
  std_msgs::Header header;
  access(message, [&] {
    std::vector<std::uint8_t> bytes(message.instance.size());
    ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    message.instance.write(out);
    ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    ros::serialization::deserialize(in, header);
  });
  return header.stamp;
}

void BagFiles::noteFailure(const BagMessage& message, const std::string& error) {
  File& file = bags_[message.bag];
  if (file.failures.empty()) file.error = error;
  file.failures.emplace(message.instance.getTime(), message.instance.getTopic());
  if (!file.has_failed) refresh(file);
  file.has_failed = true;
}

/// Makes a bag forget a chunk that it failed to decompress: rosbag keeps the overwritten buffer as the last
/// chunk. Reading another chunk replaces it; the first chunk of the bag comes last, since it is not read again.
void BagFiles::refresh(File& file) {
  if (file.ends.empty()) {
    rosbag::View view(*file.bag);
    file.ends.push_back(*view.begin());
    auto last = view.begin();
    for (auto next = view.begin(); next != view.end(); ++next) last = next;
    file.ends.push_back(*last);
  }
  for (auto end = file.ends.rbegin(); end != file.ends.rend(); ++end) {
    try {
      (void)end->size();
    } catch (const std::exception&) {  // This chunk is damaged, too.
    }
  }
}

std::string BagFiles::failures() const {
  std::ostringstream text;
  for (std::size_t bag = 0; bag < bags_.size(); ++bag) {
    for (const auto& [time, topic] : bags_[bag].failures) {
      text << bag << ' ' << time.toNSec() << ' ' << topic << ' ' << std::quoted(bags_[bag].error)
           << '\n';
    }
  }
  return text.str();
}

void BagFiles::addFailures(const std::string& failures) {
  std::istringstream text(failures);
  std::size_t bag = 0;
  std::uint64_t time_ns = 0;
  std::string topic;
  std::string error;
  while (text >> bag >> time_ns >> topic >> std::quoted(error)) {
    File& file = bags_.at(bag);
    if (file.failures.empty()) file.error = error;
    file.failures.emplace(ros::Time().fromNSec(time_ns), topic);
  }
}

std::vector<std::string> BagFiles::describeDamage() const {
  std::vector<std::string> lines;
  for (const File& file : bags_) {
    if (file.failures.empty()) continue;
    const ros::Time begin = rosbag::View(*file.bag).getBeginTime();
    const auto seconds = [&begin](const ros::Time& time) {
      return cuboid_mapping::toText(std::round(1e3 * (time - begin).toSec()) / 1e3);
    };
    lines.push_back(file.bag->getFileName() +
                    " is damaged: " + cuboid_mapping::counted(file.failures.size(), "message") +
                    " from " + seconds(file.failures.begin()->first) + " to " +
                    seconds(file.failures.rbegin()->first) +
                    " s after its start could not be read (" + file.error + "); the rest was used");
  }
  return lines;
}

}  // namespace cuboid_mapping_ros
