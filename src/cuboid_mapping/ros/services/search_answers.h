// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <cuboid_mapping/FindCorridor.h>
#include <cuboid_mapping/FindNearest.h>
#include <cuboid_mapping/FindNearestFree.h>
#include <cuboid_mapping/GetCuboids.h>
#include <cuboid_mapping/GetFreeGraph.h>

namespace cuboid_mapping_ros {

// Answers to ~nearest, ~nearest_free, ~get_cuboids, ~get_free_graph and ~find_corridor; their
// contracts are in srv/. What check_answers.h says of revision, waiting and errors holds here, too.
// Complexities are those of the functions of query/, for each point.

[[nodiscard]] cuboid_mapping::FindNearest::Response answerFindNearest(
    const MapInFrame& map, const cuboid_mapping::FindNearest::Request& request);

[[nodiscard]] cuboid_mapping::FindNearestFree::Response answerFindNearestFree(
    const MapInFrame& map, const cuboid_mapping::FindNearestFree::Request& request);

[[nodiscard]] cuboid_mapping::GetCuboids::Response answerGetCuboids(
    const MapInFrame& map, const cuboid_mapping::GetCuboids::Request& request);

[[nodiscard]] cuboid_mapping::GetFreeGraph::Response answerGetFreeGraph(
    const MapInFrame& map, const cuboid_mapping::GetFreeGraph::Request& request);

[[nodiscard]] cuboid_mapping::FindCorridor::Response answerFindCorridor(
    const MapInFrame& map, const cuboid_mapping::FindCorridor::Request& request);

}  // namespace cuboid_mapping_ros
