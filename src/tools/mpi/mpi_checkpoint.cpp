// SPDX-License-Identifier: BSD-3-Clause
#include "mpi/mpi_checkpoint.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/native_format.h"

#include <boost/algorithm/string/predicate.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using nlohmann::json;

std::string indexOf(const std::string& folder) { return folder + "/index.json"; }

json readIndex(const std::string& folder) {
  if (!std::filesystem::exists(indexOf(folder))) return nullptr;
  json index = json::parse(cuboid_mapping::readFile(indexOf(folder)), nullptr, false);
  return index.is_object() ? index : json::object();
}

}  // namespace

MpiCheckpoint::MpiCheckpoint(const MpiRanks& ranks, const std::string& output, std::string run,
                             double period_s)
    : ranks_(ranks),
      folder_(output + ".checkpoint"),
      run_(std::move(run)),
      period_s_(period_s),
      last_(std::chrono::steady_clock::now()) {}

std::string MpiCheckpoint::partName(std::uint64_t num_rounds) const {
  return folder_ + '/' + std::to_string(num_rounds) + '-' + std::to_string(ranks_.rank()) +
         ".cuboids";
}

std::string MpiCheckpoint::findFault() const {
  if (period_s_ == 0.0) return {};
  const json index = readIndex(folder_);
  if (index.is_null()) return {};
  if (index.value("ranks", 0) != ranks_.size()) {
    return "the checkpoint " + folder_ + " is of " + std::to_string(index.value("ranks", 0)) +
           " ranks: start as many, or remove it";
  }
  if (index.value("run", std::string()) != run_) {
    return "the checkpoint " + folder_ + " is of other bags or settings: remove it";
  }
  return {};
}

MpiProgress MpiCheckpoint::resume(BrickOwner& owner) const {
  MpiProgress progress;
  if (period_s_ == 0.0) return progress;
  const json index = readIndex(folder_);
  if (!index.is_null()) progress.num_rounds = index.at("rounds");
  const auto size = static_cast<std::uint64_t>(ranks_.size());
  if (ranks_.sum({progress.num_rounds}).front() != size * progress.num_rounds) {
    throw std::runtime_error(folder_ + " is not seen by all ranks: use a folder that they share");
  }
  if (progress.num_rounds == 0) return progress;
  progress.sums = index.at("sums").get<std::vector<std::uint64_t>>();
  progress.left_out.counts = index.at("left_out");
  progress.left_out.first_texts = index.at("left_out_texts");
  progress.failures = index.value("failures", "");
  const std::string bytes = cuboid_mapping::readFile(partName(progress.num_rounds));
  owner.restore(
      cuboid_mapping::fromNativeFormat(bytes, cuboid_mapping::SnapshotLimits::none()).bricks);
  return progress;
}

bool MpiCheckpoint::isDue() const {
  if (period_s_ == 0.0) return false;
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - last_;
  return ranks_.isSaidByFirst(time.count() >= period_s_);
}

void MpiCheckpoint::write(const MpiProgress& progress, const cuboid_mapping::MapSnapshot& part) {
  std::filesystem::create_directories(folder_);
  cuboid_mapping::replaceFile(partName(progress.num_rounds), toNativeFormat(part));
  (void)ranks_.sum({1});  // Waits until all parts exist.
  if (ranks_.rank() == 0) {
    const json index{{"ranks", ranks_.size()},
                     {"run", run_},
                     {"rounds", progress.num_rounds},
                     {"sums", progress.sums},
                     {"left_out", progress.left_out.counts},
                     {"left_out_texts", progress.left_out.first_texts},
                     {"failures", progress.failures}};
    cuboid_mapping::replaceFile(indexOf(folder_), index.dump(1));
  }
  (void)ranks_.sum({1});  // Waits until the older parts are not needed any more.
  const std::filesystem::path own = partName(progress.num_rounds);
  const std::string end = own.filename().string().substr(own.filename().string().find('-'));
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    const bool is_part = boost::algorithm::ends_with(entry.path().filename().string(), end);
    if (is_part && entry.path() != own) std::filesystem::remove(entry.path());
  }
  last_ = std::chrono::steady_clock::now();
}

void MpiCheckpoint::remove() const {
  if (period_s_ > 0.0 && ranks_.rank() == 0) std::filesystem::remove_all(folder_);
}

}  // namespace cuboid_mapping_ros
