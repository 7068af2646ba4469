# SPDX-License-Identifier: BSD-3-Clause
"""Answers of a map: named tuples of arrays, and the numbers in them."""
import enum
import typing

import numpy as np


class Occupancy(enum.IntEnum):
    """Class of a voxel. Occupied: log-odds >= 0."""
    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


class RayEnd(enum.IntEnum):
    """How a ray ended."""
    UNKNOWN = 0    # At the border of unknown space, which is an obstacle.
    MAX_RANGE = 1  # Nothing was in the way.
    OCCUPIED = 2   # At an occupied voxel.


class CorridorEnd(enum.IntEnum):
    """How a search for a corridor ended."""
    FOUND = 1
    START_BLOCKED = 2  # The robot meets an obstacle there, or leaves the region.
    GOAL_BLOCKED = 3
    NO_WAY = 4         # Everything that can be reached was looked at.
    TIME_LIMIT = 5


class IntegratedScan(typing.NamedTuple):
    """Counts of the points of a scan, no-returns included."""
    num_points: int        # That took part.
    num_out_of_range: int  # Left out: not finite, or outside the grid.
    num_too_far: int       # Left out: more than 65,535 voxels away.


class Boxes(typing.NamedTuple):
    """Content of n boxes; volumes in cubic metres, of all voxels that a box overlaps."""
    occupancy: np.ndarray        # (n,) uint8, Occupancy: occupied if any voxel is; else unknown if any is; else free.
    free_volume: np.ndarray      # (n,) float64
    occupied_volume: np.ndarray  # (n,) float64
    unknown_volume: np.ndarray   # (n,) float64, outside the map included.


class Cuboids(typing.NamedTuple):
    """Disjoint boxes of voxels of one class each."""
    cells: np.ndarray             # (n, 6) int32, voxels: min x, y, z, max x, y, z; max excluded.
    boxes: np.ndarray             # (n, 6) float64, the same in metres.
    occupancy: np.ndarray         # (n,) uint8, Occupancy.
    mean_probability: np.ndarray  # (n,) float32, of being occupied: the mean over the voxels.


class Rays(typing.NamedTuple):
    """Where each of n rays ended; lengths in metres."""
    end: np.ndarray             # (n,) uint8, RayEnd.
    distance: np.ndarray        # (n,) float64, from the origin to the point.
    point: np.ndarray           # (n, 3) float64, on the face of the voxel that was hit.
    first_unknown: np.ndarray   # (n,) float64, where the first unknown space begins; inf: there is none.
    unknown_length: np.ndarray  # (n,) float64, of the ray in unknown space.


class Paths(typing.NamedTuple):
    """How far a box gets on each of m paths; lengths in metres."""
    free: np.ndarray         # (m,) bool, to the end.
    free_length: np.ndarray  # (m,) float64, up to where it first meets an obstacle.
    length: np.ndarray       # (m,) float64, of the whole path.
    segment: np.ndarray      # (m,) int64, number of the waypoint from which it meets one; -1: none.
    point: np.ndarray        # (m, 3) float64, centre of the box there; NaN: nowhere.


class Poses(typing.NamedTuple):
    """Whether a body fits at each of n poses."""
    free: np.ndarray   # (n,) bool.
    part: np.ndarray   # (n,) int64, a part that meets an obstacle: spheres first, then boxes; -1: none.
    point: np.ndarray  # (n, 3) float64, metres: centre of a voxel that it meets; NaN: none.


class Nearest(typing.NamedTuple):
    """The k cuboids nearest to each of n points, nearest first; distance inf and NaN where there are fewer."""
    distance: np.ndarray   # (n, k) float64, metres; 0 inside.
    point: np.ndarray      # (n, k, 3) float64, of the cuboid, closest to the one that was asked for.
    boxes: np.ndarray      # (n, k, 6) float64, metres: min x, y, z, max x, y, z.
    occupancy: np.ndarray  # (n, k) uint8, Occupancy; UNKNOWN where there are fewer.


class Corridor(typing.NamedTuple):
    """A way for a robot; without any elements unless `end` is FOUND."""
    end: CorridorEnd
    boxes: np.ndarray    # (b, 6) float64, metres: without obstacles, as large as they can be, from start to goal.
    portals: np.ndarray  # (b - 1, 3) float64, metres: centres of what successive boxes share.
    path: np.ndarray     # (p, 3) float64, metres: from start to goal, of the robot's centre.
    length: float        # Of the path, metres.
    num_visited: int     # Boxes that the search has looked at.


class BoxCover(typing.NamedTuple):
    """Boxes that cover all that is occupied; volumes in cubic metres, each voxel counted once."""
    boxes: np.ndarray       # (n, 6) float64, metres: min x, y, z, max x, y, z; the largest first.
    occupied_volume: float  # Of the occupied voxels in the boxes.
    added_volume: float     # Of all other voxels in the boxes.
    left_out_volume: float  # Of occupied voxels inside keep_free.


class FreeBoxes(typing.NamedTuple):
    """Boxes of free voxels; volumes in cubic metres, each voxel counted once."""
    boxes: np.ndarray      # (n, 6) float64, metres: min x, y, z, max x, y, z.
    covered_volume: float  # Of the boxes.
    missing_volume: float  # Of the free voxels in no box.


class Frontiers(typing.NamedTuple):
    """n clusters of free voxels beside unknown ones, the largest first."""
    center: np.ndarray          # (n, 3) float64, metres: of the voxel nearest to the mean of the cluster.
    place: np.ndarray           # (n, 3) float64, metres: the nearest place where the robot fits; NaN: none.
    unknown_volume: np.ndarray  # (n,) float64, cubic metres, that is seen from the place.
    voxels: np.ndarray          # (m, 3) float64, metres: centres, cluster by cluster.
    end: np.ndarray             # (n,) int64: cluster i has the voxels from end[i - 1] (0 for the first) to end[i].


class Distances(typing.NamedTuple):
    """From n points to the nearest obstacles."""
    distance: np.ndarray  # (n,) float64, metres: 0 in an obstacle, inf where none is within the bound.
    gradient: np.ndarray  # (n, 3) float64: unit vector away from the nearest obstacle; zero where there is none.
