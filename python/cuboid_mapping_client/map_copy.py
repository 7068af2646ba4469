# SPDX-License-Identifier: BSD-3-Clause
"""A copy of a map that is kept up with the messages CuboidMap and CuboidMapUpdate. No ROS in it."""
import collections
import zlib

import numpy as np

# Edge, in voxels, of the cubes of space that a copy is kept in: it is changed cube by cube.
_CHUNK_EDGE = 128

# Disjoint cuboids: `bounds` (n, 6) int32, in voxels (min x, y, z, max x, y, z; max excluded), and
# `log_odds` (n,) float32, of being occupied.
Cuboids = collections.namedtuple('Cuboids', 'bounds log_odds')


def _cut(cuboids, low, high):
    """The parts of cuboids inside a box [low, high)."""
    bounds = np.hstack([np.maximum(cuboids.bounds[:, :3], low), np.minimum(cuboids.bounds[:, 3:], high)])
    inside = (bounds[:, :3] < bounds[:, 3:]).all(axis=1)
    return Cuboids(bounds[inside], cuboids.log_odds[inside])


def _cut_out(cuboids, low, high):
    """The parts of cuboids outside a box [low, high): at most six for each."""
    touched = ((cuboids.bounds[:, :3] < high) & (cuboids.bounds[:, 3:] > low)).all(axis=1)
    parts = [Cuboids(cuboids.bounds[~touched], cuboids.log_odds[~touched])]
    rest = Cuboids(cuboids.bounds[touched].copy(), cuboids.log_odds[touched])
    for axis in range(3):
        for edge, outer in ((low, axis), (high, axis + 3)):
            side = rest.bounds.copy()
            if outer < 3:
                side[:, axis + 3] = np.minimum(side[:, axis + 3], edge[axis])
                rest.bounds[:, axis] = np.maximum(rest.bounds[:, axis], edge[axis])
            else:
                side[:, axis] = np.maximum(side[:, axis], edge[axis])
                rest.bounds[:, axis + 3] = np.minimum(rest.bounds[:, axis + 3], edge[axis])
            full = side[:, axis] < side[:, axis + 3]
            parts.append(Cuboids(side[full], rest.log_odds[full]))
    return _join(parts)


def _join(parts):
    if not parts:
        return Cuboids(np.empty((0, 6), np.int32), np.empty(0, np.float32))
    return Cuboids(np.concatenate([part.bounds for part in parts]),
                   np.concatenate([part.log_odds for part in parts]))


def _chunks(low, high):
    """Least cells of the chunks that share a voxel with a box."""
    first = np.floor_divide(low, _CHUNK_EDGE) * _CHUNK_EDGE
    return [(x, y, z)
            for x in range(first[0], high[0], _CHUNK_EDGE)
            for y in range(first[1], high[1], _CHUNK_EDGE)
            for z in range(first[2], high[2], _CHUNK_EDGE)]


def _unpack(message):
    """Boxes, number of cuboids in each, and the cuboids of a CuboidMapUpdate."""
    data = zlib.decompress(bytes(message.data))
    num_boxes, num_cuboids = message.num_boxes, message.num_cuboids
    boxes = np.frombuffer(data, '<i4', 6 * num_boxes).reshape(-1, 6)
    counts = np.frombuffer(data, '<u4', num_boxes, 24 * num_boxes).astype(np.int64)
    rest = np.frombuffer(data, np.uint8, 8 * num_cuboids, 28 * num_boxes)
    offsets, low, high = np.split(rest, [6 * num_cuboids, 7 * num_cuboids])
    numbers = low.astype(np.int64) + 256 * high.astype(np.int64)
    bounds = offsets.reshape(-1, 6) + np.tile(np.repeat(boxes[:, :3], counts, axis=0), 2)
    values = np.array(message.values, np.float32)
    return boxes, counts, Cuboids(bounds.astype(np.int32), values[numbers])


class MapCopy:
    """A map in numpy arrays. Not thread-safe.

    Cuboids that reach over a multiple of 128 voxels are cut there; every voxel is as in the map.
    """

    def __init__(self):
        self.instance = None
        self.revision = 0
        self.resolution = None
        self._by_chunk = {}

    def take_map(self, message):
        """Takes a CuboidMap, unless it is older than the copy."""
        if message.instance == self.instance and message.revision < self.revision:
            return
        self.instance, self.revision = message.instance, message.revision
        self.resolution = message.resolution
        self._by_chunk = {}
        self._insert(Cuboids(np.array(message.bounds, np.int32).reshape(-1, 6),
                             np.array(message.log_odds, np.float32)))

    def take_update(self, message):
        """Takes a CuboidMapUpdate.

        Returns False when a CuboidMap is needed: there was none yet, or updates were lost.
        """
        if message.instance != self.instance:
            return False
        if message.revision <= self.revision:
            return True
        if message.base > self.revision or message.everything:
            return False
        boxes, counts, cuboids = _unpack(message)
        ends = np.cumsum(counts)
        for box, first, end in zip(boxes, ends - counts, ends):
            self._drop(box[:3], box[3:])
            self._insert(Cuboids(cuboids.bounds[first:end], cuboids.log_odds[first:end]))
        self.revision = message.revision
        return True

    def cuboids(self, low=None, high=None):
        """All cuboids, or the parts of them in the box of voxels [low, high)."""
        if low is None:
            return _join(list(self._by_chunk.values()))
        low, high = np.asarray(low), np.asarray(high)
        parts = [_cut(part, low, high) for chunk, part in self._by_chunk.items()
                 if (np.array(chunk) < high).all() and (np.array(chunk) + _CHUNK_EDGE > low).all()]
        return _join(parts)

    def voxels_of(self, low_m, high_m):
        """The box of voxels that a box in metres overlaps, as two arrays of three."""
        low = np.floor(np.asarray(low_m) / self.resolution + 1e-6).astype(np.int64)
        high = np.ceil(np.asarray(high_m) / self.resolution - 1e-6).astype(np.int64)
        return low, high

    def count(self, low_m, high_m):
        """Free, occupied and unknown voxels of a box in metres; unknown includes outside the map."""
        low, high = self.voxels_of(low_m, high_m)
        found = self.cuboids(low, high)
        volumes = np.prod(found.bounds[:, 3:].astype(np.int64) - found.bounds[:, :3], axis=1)
        occupied = int(volumes[found.log_odds >= 0].sum())
        free = int(volumes.sum()) - occupied
        return free, occupied, int(np.prod(high - low)) - free - occupied

    def _insert(self, cuboids):
        if not len(cuboids.log_odds):
            return
        first = np.floor_divide(cuboids.bounds[:, :3], _CHUNK_EDGE) * _CHUNK_EDGE
        last = np.floor_divide(cuboids.bounds[:, 3:] - 1, _CHUNK_EDGE) * _CHUNK_EDGE
        inside = (first == last).all(axis=1)
        chunks, which = np.unique(first[inside], axis=0, return_inverse=True)
        order = np.argsort(which.reshape(-1), kind='stable')
        ends = np.cumsum(np.bincount(which.reshape(-1), minlength=len(chunks)))
        bounds, log_odds = cuboids.bounds[inside][order], cuboids.log_odds[inside][order]
        begin = 0
        for chunk, end in zip(chunks, ends):
            self._add(tuple(int(c) for c in chunk), Cuboids(bounds[begin:end], log_odds[begin:end]))
            begin = end
        for bound, value in zip(cuboids.bounds[~inside], cuboids.log_odds[~inside]):
            one = Cuboids(bound.reshape(1, 6), np.array([value], np.float32))
            for chunk in _chunks(bound[:3], bound[3:]):
                self._add(chunk, _cut(one, np.array(chunk), np.array(chunk) + _CHUNK_EDGE))

    def _add(self, chunk, cuboids):
        there = self._by_chunk.get(chunk)
        self._by_chunk[chunk] = cuboids if there is None else _join([there, cuboids])

    def _drop(self, low, high):
        for chunk in _chunks(low, high):
            there = self._by_chunk.get(chunk)
            if there is None:
                continue
            left = _cut_out(there, low, high)
            if len(left.log_odds):
                self._by_chunk[chunk] = left
            else:
                del self._by_chunk[chunk]
