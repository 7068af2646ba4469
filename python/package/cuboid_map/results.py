# SPDX-License-Identifier: BSD-3-Clause
"""Answers of a map: named tuples of arrays, and their enumerations."""
import enum
import typing

import numpy as np


class Occupancy(enum.IntEnum):
    """Class of a voxel. Occupied: log-odds >= 0."""
    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


class RayEnd(enum.IntEnum):
    """End of a ray, with the numbers of the service cast_rays; those of C++ differ."""
    UNKNOWN = 0    # The border of unknown space blocks it.
    MAX_RANGE = 1  # Nothing blocks it.
    OCCUPIED = 2   # An occupied voxel blocks it.


class CorridorEnd(enum.IntEnum):
    """End of a search for a corridor."""
    FOUND = 1
    START_BLOCKED = 2  # The robot meets an obstacle at the start, or leaves the region.
    GOAL_BLOCKED = 3
    NO_WAY = 4         # All reachable space was searched.
    TIME_LIMIT = 5


class IntegratedScan(typing.NamedTuple):
    """Counts of the points of a scan, no-returns included."""
    num_points: int        # Beams that took part.
    num_out_of_range: int  # Points left out: not finite, or outside the grid.
    num_too_far: int       # Points left out: more than 65,535 voxels away along an axis.


class Boxes(typing.NamedTuple):
    """Content of n boxes; volumes in cubic metres, of all voxels that a box overlaps."""
    occupancy: np.ndarray        # (n,) uint8, Occupancy: OCCUPIED if any voxel is; else UNKNOWN if any is; else FREE.
    free_volume: np.ndarray      # (n,) float64
    occupied_volume: np.ndarray  # (n,) float64
    unknown_volume: np.ndarray   # (n,) float64, space outside the map included.


class Cuboids(typing.NamedTuple):
    """Disjoint boxes of voxels of one class each."""
    cells: np.ndarray             # (n, 6) int32, voxels: min x, y, z, max x, y, z; max excluded.
    boxes: np.ndarray             # (n, 6) float64, the boxes in metres.
    occupancy: np.ndarray         # (n,) uint8, Occupancy.
    mean_probability: np.ndarray  # (n,) float32, probability of being occupied, mean over the voxels.


class Rays(typing.NamedTuple):
    """Ends of n rays; lengths in metres."""
    end: np.ndarray             # (n,) uint8, RayEnd.
    distance: np.ndarray        # (n,) float64, from the origin to the point.
    point: np.ndarray           # (n, 3) float64, on the face of the hit voxel; for MAX_RANGE the end of the ray.
    first_unknown: np.ndarray   # (n,) float64, start of the first unknown space; inf: none.
    unknown_length: np.ndarray  # (n,) float64, length of the ray in unknown space.


class Paths(typing.NamedTuple):
    """Free lengths of a box on m paths; lengths in metres."""
    free: np.ndarray         # (m,) bool, the whole path is free.
    free_length: np.ndarray  # (m,) float64, up to the first obstacle.
    length: np.ndarray       # (m,) float64, length of the whole path.
    segment: np.ndarray      # (m,) int64, index of the last waypoint before the obstacle; -1: none.
    point: np.ndarray        # (m, 3) float64, centre of the box at the obstacle; NaN: none.


class Poses(typing.NamedTuple):
    """Whether a body fits at each of n poses."""
    free: np.ndarray   # (n,) bool.
    part: np.ndarray   # (n,) int64, a part that meets an obstacle: spheres first, then boxes; -1: none.
    point: np.ndarray  # (n, 3) float64, metres: centre of a blocking voxel; NaN: none.


class Motion(typing.NamedTuple):
    """Free length of the motion of a body from pose to pose; lengths in metres."""
    free: bool          # The whole motion is free.
    free_length: float  # Length of the path of the body's origin up to the first obstacle.
    length: float       # Length of the whole path.
    segment: int        # Index of the last pose before the obstacle; -1: none.
    pose: np.ndarray    # (4, 4) float64: pose of the body at the obstacle, or the last pose of a free motion.
    part: int           # The part that meets the obstacle: spheres first, then boxes; -1: none.
    point: np.ndarray   # (3,) float64, metres: centre of a voxel that this part meets; NaN: none.


class PosePath(typing.NamedTuple):
    """A way for a body that turns; without poses unless `end` is FOUND."""
    end: CorridorEnd
    poses: np.ndarray  # (n, 4, 4) float64: from start to goal.
    length: float      # Length of the path of the body's origin, metres.
    num_poses: int     # Number of poses at which the search has checked the map.
    start_distance: float  # Length of the first motion if it leads out of obstacles, metres; else 0.
    goal_distance: float   # Distance from the goal to the end of the path, metres.
    point: np.ndarray      # (3,) float64: centre of a voxel that the body touches at the start, else at the goal; NaN: none.


class Nearest(typing.NamedTuple):
    """The k cuboids nearest to each of n points, nearest first; missing ones have distance inf, and NaN."""
    distance: np.ndarray   # (n, k) float64, metres; 0 inside.
    point: np.ndarray      # (n, k, 3) float64, point of the cuboid closest to the query point.
    boxes: np.ndarray      # (n, k, 6) float64, metres: min x, y, z, max x, y, z.
    occupancy: np.ndarray  # (n, k) uint8, Occupancy; UNKNOWN for missing ones.


class Corridor(typing.NamedTuple):
    """A corridor for a robot; boxes, portals and path are empty unless `end` is FOUND."""
    end: CorridorEnd
    boxes: np.ndarray    # (b, 6) float64, metres: boxes without obstacles, as large as possible, from start to goal.
    portals: np.ndarray  # (b - 1, 3) float64, metres: centres of the overlaps of successive boxes.
    path: np.ndarray     # (p, 3) float64, metres: the robot's centre from start to goal.
    length: float        # Length of the path, metres.
    num_visited: int     # Boxes that the search has made.
    start_distance: float  # Length of the first segment of the path if it leads out of obstacles, metres; else 0.
    goal_distance: float   # Distance from the goal to the end of the path, metres.
    point: np.ndarray      # (3,) float64: centre of a voxel that the robot touches at the start, else at the goal; NaN: none.


class BoxCover(typing.NamedTuple):
    """Boxes that cover all occupied voxels; volumes in cubic metres, each voxel counted once."""
    boxes: np.ndarray       # (n, 6) float64, metres: min x, y, z, max x, y, z; the largest first, unless `previous` is given.
    occupied_volume: float  # Volume of the occupied voxels in the boxes.
    added_volume: float     # Volume of all other voxels in the boxes.
    left_out_volume: float  # Volume of occupied voxels inside keep_free.
    lost: np.ndarray        # (m, 6) float64, metres: the robot where it can no longer get to; see keep_passages.


class FreeBoxes(typing.NamedTuple):
    """Boxes of free voxels; volumes in cubic metres, each voxel counted once."""
    boxes: np.ndarray      # (n, 6) float64, metres: min x, y, z, max x, y, z.
    covered_volume: float  # Volume of the boxes.
    missing_volume: float  # Volume of the free voxels in no box.


class Frontiers(typing.NamedTuple):
    """n clusters of free voxels beside unknown ones, the largest first."""
    center: np.ndarray          # (n, 3) float64, metres: centre of the voxel nearest to the mean of the cluster.
    place: np.ndarray           # (n, 3) float64, metres: the nearest place where the robot fits; NaN: none.
    unknown_volume: np.ndarray  # (n,) float64, cubic metres visible from the place.
    voxels: np.ndarray          # (m, 3) float64, metres: centres of the voxels, cluster by cluster.
    end: np.ndarray             # (n,) int64: cluster i has the voxels from end[i - 1] (0 for the first) to end[i].


class Distances(typing.NamedTuple):
    """Distances of n points from the nearest obstacles."""
    distance: np.ndarray  # (n,) float64, metres: 0 in an obstacle, inf if none is within the bound.
    gradient: np.ndarray  # (n, 3) float64: unit vector away from the nearest obstacle; zero if there is none.
