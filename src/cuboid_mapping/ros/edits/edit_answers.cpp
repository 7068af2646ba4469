// SPDX-License-Identifier: BSD-3-Clause
// Edits of boxes.
#include "cuboid_mapping/ros/edits/map_edits.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::toText;

using SetRequest = SetBox::Request;

constexpr Entries kSetBoxes{"boxes", 48};

bool isFilled(const SetRequest& request) {
  return request.occupancy == SetRequest::FREE || request.occupancy == SetRequest::OCCUPIED;
}

void checkOccupancy(const SetRequest& request) {
  if (request.occupancy > SetRequest::KEEP) {
    throw Refusal("occupancy is " + std::to_string(request.occupancy) +
                  ": use UNKNOWN (0), FREE (1), OCCUPIED (2) or KEEP (3)");
  }
  const double probability = request.probability;
  if (probability == 0.0) return;
  const bool is_right = request.occupancy == SetRequest::FREE
                            ? probability > 0.0 && probability < 0.5
                            : probability >= 0.5 && probability < 1.0;
  if (!isFilled(request) || !is_right) {
    throw Refusal("probability is " + toText(probability, 6) +
                  ": use 0, or below 0.5 for FREE, from 0.5 to below 1 for OCCUPIED");
  }
}

/// Clamped log-odds, as after a cloud.
float toLogOdds(const SensorModel& model, const SetRequest& request) {
  const bool is_free = request.occupancy == SetRequest::FREE;
  if (request.probability == 0.0F) return is_free ? model.min() : model.max();
  const float log_odds = cuboid_mapping::toLogOdds(request.probability);
  return std::min(std::max(log_odds, model.min()), model.max());
}

/// Bricks of a box that are set at a time, with exclusive access: some milliseconds.
constexpr double kBricksATurn = 4096.0;

/// Divides a box into parts with a maximum number of bricks, cut at their borders: slabs along z, rows along y,
/// and pieces along x.
std::vector<CellBox> divide(const CellBox& box) {
  std::vector<CellBox> parts{box};
  for (int axis = 2; axis >= 0; --axis) {
    std::vector<CellBox> smaller;
    for (const CellBox& part : parts) {
      const double num_layers = ((part.max[axis] - 1) >> 3) - (part.min[axis] >> 3) + 1.0;
      const double layers = std::max(1.0, std::floor(kBricksATurn * num_layers / numBricks(part)));
      for (CellBox piece = part; piece.min[axis] < part.max[axis];
           piece.min[axis] = piece.max[axis]) {
        const double end = ((piece.min[axis] >> 3) + layers) * kBrickEdge;
        piece.max[axis] = static_cast<std::int32_t>(std::min(end, 1.0 * part.max[axis]));
        smaller.push_back(piece);
      }
    }
    parts = std::move(smaller);
  }
  return parts;
}

/// The parts of a box to set one after the other. Making a box unknown costs only as much as its known part: a large
/// one is divided inside the bounds of the map, unless these are almost empty.
std::vector<CellBox> partsOf(const GuardedMap& map, const CellBox& box) {
  if (numBricks(box) <= kMaxSetBricks) return divide(box);
  return map.read([&](const CuboidMap& content) -> std::vector<CellBox> {
    constexpr double kMaxLookups = 16.0;  // For each known brick.
    const CellBox known = intersect(box, content.bounds().value_or(CellBox()));
    const auto num_known = static_cast<double>(content.voxels().size());
    if (known.isEmpty() || numBricks(known) > kMaxLookups * num_known) return {box};
    std::vector<CellBox> parts = divide(known);
    for (const CellBox& rest : subtractAll({box}, {known})) parts.push_back(rest);
    return parts;
  });
}

ChangeSet setPart(CuboidMap& map, const CellBox& box, const SetRequest& request) {
  std::vector<UniformBox> boxes;
  if (isFilled(request)) boxes.push_back({box, toLogOdds(map.sensorModel(), request)});
  return map.replace(box, boxes);
}

/// Locks or unlocks a box, and sets it part by part, until the budget is spent.
void setBox(GuardedMap& map, const CellBox& box, const SetRequest& request, Budget& budget) {
  const auto set_lock = [&](CuboidMap& content) {
    request.lock != 0 ? content.lock(box) : content.unlock(box);
  };
  if (request.occupancy == SetRequest::KEEP) {
    return map.edit([&](CuboidMap& content) {
      map.keepForUndo({});
      set_lock(content);
      return ChangeSet{content.revision(), false, {}};
    });
  }
  bool is_locked = false;
  for (const CellBox& part : partsOf(map, box)) {
    if (!budget.checkClock()) return;
    map.editIn(
        part,
        [&](CuboidMap& content) {
          map.keepForUndo(part);
          if (!std::exchange(is_locked, true)) set_lock(content);
          return setPart(content, part, request);
        },
        box);
  }
}

}  // namespace

void answer(ServiceCall& call, const SetBox::Request& request, SetBox::Response& response) {
  checkOccupancy(request);
  const std::vector<CellBox> boxes = call.boxes(request.boxes, request.inflation, kSetBoxes);
  double num_bricks = 0.0;
  for (const CellBox& box : boxes) num_bricks += isFilled(request) ? numBricks(box) : 0.0;
  if (num_bricks > kMaxSetBricks) {
    throw Refusal("the boxes contain " + toText(num_bricks) +
                  " bricks of 8 x 8 x 8 voxels: at most " + toText(kMaxSetBricks) +
                  " can be set free or occupied at once");
  }
  const auto turn = call.map().beginEdit();
  call.changeEach(kSetBoxes, boxes.size(), [&](std::size_t i, Budget& budget) {
    setBox(call.map(), boxes[i], request, budget);
  });
  for (std::size_t i = 0; i < call.info().answered; ++i) {
    response.boxes.push_back(boxMessage(call.map().grid(), boxes[i]));
  }
}

void answer(ServiceCall& call, const GetLocks::Request& /*request*/, GetLocks::Response& response) {
  call.read(sizeof(Box), [&](const CuboidMap& map, Budget& /*budget*/) {
    for (const CellBox& box : map.lockedBoxes()) {
      response.boxes.push_back(boxMessage(map.grid(), box));
    }
  });
}

std_srvs::Trigger::Response undoEdit(GuardedMap& map) {
  std_srvs::Trigger::Response response;
  try {
    const auto num_left = map.undoEdit();
    response.success = static_cast<std::uint8_t>(num_left.has_value());
    response.message = num_left ? "undone; " + std::to_string(*num_left) + " more can be undone"
                                : "nothing to undo: at most 20 edits (64 MB) are kept, none from "
                                  "before the map was reset, loaded, moved or corrected";
  } catch (const std::exception& exception) {
    response.message = std::string("undone in part, call again for the rest: ") + exception.what();
  }
  return response;
}

}  // namespace cuboid_mapping_ros
