// SPDX-License-Identifier: BSD-3-Clause
// Answers about boxes.
#include "cuboid_mapping/ros/queries/answers.h"

#include "cuboid_mapping/boxes/box_cover.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/value_query.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_ros {
namespace {

template <typename ConstantsT>
constexpr bool hasClasses() {
  return ConstantsT::FREE == static_cast<int>(Occupancy::kFree) &&
         ConstantsT::OCCUPIED == static_cast<int>(Occupancy::kOccupied);
}
static_assert(hasClasses<QueryBox::Response>() && hasClasses<CheckBoxes::Response>() &&
              hasClasses<MapCuboid>());

constexpr Entries kBoxes{"boxes", 30};
constexpr std::size_t kCuboidBytes = 53;

/// Answer of ~check_boxes and ~query_box for a box.
struct BoxContent {
  BoxQueryResult volumes;
  float max_probability = std::numeric_limits<float>::quiet_NaN();
};

BoxContent lookInto(const CuboidMap& map, const CellBox& box, Budget& budget) {
  BoxContent content;
  content.volumes = queryCells(map, box, budget).value;
  if (const auto log_odds = maxLogOdds(map, box, budget); log_odds.isFound()) {
    content.max_probability = static_cast<float>(toProbability(*log_odds));
  }
  return content;
}

/// As selectCuboids(), for joined cuboids.
Answer<std::vector<Cuboid>> selectJoined(const CuboidMap& map, const CellBox& region,
                                         const CuboidSelection& selection, Budget& budget) {
  std::vector<Cuboid> selected;
  bool is_cut = false;
  for (const Cuboid& cuboid : joinCuboids(map, region, selection.filter, budget).value) {
    const Cell size = cuboid.box.size();
    if (std::min({size.x, size.y, size.z}) < selection.min_edge) continue;
    is_cut = selected.size() == selection.max_cuboids || !budget.addEntries();
    if (is_cut) break;
    selected.push_back(cuboid);
  }
  return answerWithAll(std::move(selected), !is_cut && !budget.isSpent());
}

/// Adds selected cuboids to an answer, with probabilities of the same revision: nobody else gets a turn.
/// @return Whether there are more.
bool addCuboids(const CuboidMap& map, const Answer<std::vector<Cuboid>>& selected, Budget& budget,
                std::vector<MapCuboid>& cuboids) {
  cuboids.reserve(selected.value.size());
  for (const Cuboid& cuboid : selected.value) {
    const MapCuboid message = cuboidMessage(map, cuboid, budget);
    if (!budget.spend()) break;  // Its probability may not have been read.
    cuboids.push_back(message);
  }
  return selected.status == AnswerStatus::kBudgetSpent;
}

constexpr Entries kKeepFree{"keep_free", 48};
constexpr Entries kPrevious{"previous", kCuboidBytes};

CoverTask readCover(ServiceCall& call, const GetCuboids::Request& request, const CellBox& region) {
  CoverTask task;
  task.max_boxes = request.max_boxes;
  task.region = region;
  task.keep_free = call.boxes(request.keep_free, 0.0, kKeepFree);
  task.previous = call.boxes(request.previous, 0.0, kPrevious);
  const Eigen::Vector3d robot_m(request.keep_passages.x, request.keep_passages.y,
                                request.keep_passages.z);
  if ((robot_m.array() < 0.0).all()) {
    task.keep_passages_m.setZero();
  } else if (!robot_m.isZero(0.0)) {
    task.keep_passages_m = call.size(request.keep_passages, 0.0, "keep_passages");
  }
  return task;
}

void answerCover(ServiceCall& call, const CoverTask& task, GetCuboids::Response& response) {
  call.read(kCuboidBytes, [&](const CuboidMap& map, Budget& budget) {
    const auto found = coverOccupied(map, task, budget);
    if (!found.fault.empty()) throw Refusal(found.fault);
    if (found.isNotFound()) {
      throw Refusal("max_boxes is " + std::to_string(task.max_boxes) + ", but " +
                    std::to_string(found.value.boxes.size()) +
                    " boxes are needed, because of keep_free or of voxels far from all others");
    }
    for (const CellBox& box : found.value.boxes) {
      response.cuboids.push_back(
          cuboidMessage(map, {box, Occupancy::kOccupied}, Budget::unlimited()));
    }
    for (const CellBox& place : found.value.lost) {
      response.lost.push_back(boxMessage(map.grid(), place));
    }
    response.added_volume = found.value.added_volume_m3;
    const bool has_cover = !response.cuboids.empty();
    call.noteEnd(
        budget,
        std::string(
            has_cover
                ? "the boxes cover everything occupied, but may close ways that others leave open"
                : "there are no boxes yet") +
            ": ask for a smaller region, or for more boxes");
  });
}

}  // namespace

void noteCut(ServiceCall& call, const Budget& budget, bool is_cut) {
  call.info().truncated = static_cast<std::uint8_t>(is_cut);
  if (is_cut) call.info().message = "there are more cuboids than limit";
  call.noteEnd(budget, "ask for a smaller region, or region by region");
}

void setInfo(const AnswerInfo& info, QueryBox::Response& response) {
  response.success = info.success;
  response.message = info.message;
  response.header = info.header;
  response.revision = info.revision;
  response.instance = info.instance;
  response.replacements = info.replacements;
  response.truncated = info.truncated;
}

void answer(ServiceCall& call, const QueryBox::Request& request, QueryBox::Response& response) {
  if (request.cuboids > QueryBox::Request::CUBOIDS_ALL) {
    throw Refusal("cuboids is " + std::to_string(request.cuboids) +
                  ": use one of the CUBOIDS_* values, 0 to 3");
  }
  Box asked;
  asked.min = request.min;
  asked.max = request.max;
  const CellBox box = call.box(asked, 0.0, {"box"});
  call.read(kCuboidBytes, [&](const CuboidMap& map, Budget& budget) {
    const BoxContent content = lookInto(map, box, budget);
    response.free_volume = content.volumes.free_volume_m3;
    response.occupied_volume = content.volumes.occupied_volume_m3;
    response.unknown_volume = content.volumes.unknown_volume_m3;
    response.occupancy = static_cast<std::uint8_t>(content.volumes.occupancy());
    response.max_probability = content.max_probability;
    if (request.cuboids != QueryBox::Request::CUBOIDS_NONE) {
      CuboidSelection selection;
      selection.filter = ServiceCall::classes(request.cuboids);
      selection.is_clipped = request.clip != 0;
      addCuboids(map, selectCuboids(map, box, selection, budget), budget, response.cuboids);
    }
    call.noteEnd(budget, "ask for a smaller box, or for fewer cuboids");
  });
  const Box used = boxMessage(call.map().grid(), box);
  response.min = used.min;
  response.max = used.max;
}

void fillBlank(const MapInFrame& /*anchor*/, const CheckBoxes::Request& request,
               CheckBoxes::Response& response) {
  const std::size_t num_boxes = request.boxes.size();
  response.blocked.assign(num_boxes, static_cast<std::uint8_t>(true));
  response.occupancy.assign(num_boxes, CheckBoxes::Response::UNKNOWN);
  response.free_volume.assign(num_boxes, 0.0);
  response.occupied_volume.assign(num_boxes, 0.0);
  response.unknown_volume.assign(num_boxes, 0.0);
  response.max_probability.assign(num_boxes, std::numeric_limits<float>::quiet_NaN());
}

void answer(ServiceCall& call, const CheckBoxes::Request& request, CheckBoxes::Response& response) {
  const UnknownPolicy policy = ServiceCall::policy(request.unknown);
  const std::vector<CellBox> boxes = call.boxes(request.boxes, request.inflation, kBoxes);
  call.readEach(kBoxes, boxes.size(), [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const BoxContent content = lookInto(map, boxes[i], budget);
    if (budget.isSpent()) return;
    const Occupancy occupancy = content.volumes.occupancy();
    const bool is_free = occupancy == Occupancy::kFree ||
                         (occupancy == Occupancy::kUnknown && policy == UnknownPolicy::kFree);
    response.blocked[i] = static_cast<std::uint8_t>(!is_free);
    response.occupancy[i] = static_cast<std::uint8_t>(occupancy);
    response.free_volume[i] = content.volumes.free_volume_m3;
    response.occupied_volume[i] = content.volumes.occupied_volume_m3;
    response.unknown_volume[i] = content.volumes.unknown_volume_m3;
    response.max_probability[i] = content.max_probability;
  });
}

void answer(ServiceCall& call, const GetCuboids::Request& request, GetCuboids::Response& response) {
  const CellBox region =
      request.everything != 0 ? kAllCells : call.box(request.region, request.inflation, {"region"});
  call.requireLoaded(region);
  if (request.max_boxes > 0) return answerCover(call, readCover(call, request, region), response);
  CuboidSelection selection;
  selection.filter = ServiceCall::classes(request.classes);
  const double min_edge =
      std::ceil(ServiceCall::notNegative(request.min_edge, "min_edge") / call.resolution() - 1e-6);
  selection.min_edge = static_cast<std::int32_t>(std::min(min_edge, 1.0 * Grid::kMaxCell));
  selection.is_clipped = request.clip != 0;
  selection.max_cuboids = toLimit(request.limit);
  call.read(kCuboidBytes, [&](const CuboidMap& map, Budget& budget) {
    const auto selected = request.joined != 0 ? selectJoined(map, region, selection, budget)
                                              : selectCuboids(map, region, selection, budget);
    noteCut(call, budget, addCuboids(map, selected, budget, response.cuboids));
  });
}

}  // namespace cuboid_mapping_ros
