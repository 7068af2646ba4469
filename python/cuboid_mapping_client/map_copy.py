# SPDX-License-Identifier: BSD-3-Clause
"""A copy of a map that is kept up with the messages FullCuboidMap and CuboidMapUpdate. No ROS in it."""
import collections
import zlib

import numpy as np

# Edge of a brick in voxels.
_EDGE = 8

# Disjoint cuboids of one class: `bounds` (n, 6) int32, in voxels (min x, y, z, max x, y, z; max excluded), and
# `occupied` (n,) bool.
Cuboids = collections.namedtuple('Cuboids', 'bounds occupied')

# What is in one brick: `bounds` and `occupied` of its cuboids, and `log_odds` (512,) float32 by voxel (64 z + 8 y + x
# from the least voxel of the brick), NaN where it is unknown; None where log-odds do not travel.
_Brick = collections.namedtuple('_Brick', 'bounds occupied log_odds')


class DamagedMessage(ValueError):
    """The arrays of a message do not fit together."""


def _cut(cuboids, low, high):
    """The parts of cuboids inside a box [low, high)."""
    bounds = np.hstack([np.maximum(cuboids.bounds[:, :3], low), np.minimum(cuboids.bounds[:, 3:], high)])
    inside = (bounds[:, :3] < bounds[:, 3:]).all(axis=1)
    return Cuboids(bounds[inside], cuboids.occupied[inside])


def _volumes(bounds):
    return np.prod(bounds[:, 3:].astype(np.int64) - bounds[:, :3], axis=1)


class _Reader:
    """Takes arrays from bytes, one after the other."""

    def __init__(self, data):
        self._data = data
        self._at = 0

    def take(self, dtype, count):
        if count == 0:
            return np.empty(0, dtype)
        taken = np.frombuffer(self._data, dtype, count, self._at)
        self._at += taken.nbytes
        return taken

    @property
    def num_left(self):
        return len(self._data) - self._at


def _read_values(message, reader, num_voxels):
    """Log-odds of all voxels of all cuboids, in their order."""
    values = np.array(message.values, np.float32)
    num_bytes = 1
    while num_bytes < 4 and len(values) > 1 << 8 * num_bytes:
        num_bytes += 1
    if reader.num_left != num_bytes * num_voxels:
        raise DamagedMessage('%d bytes are left for %d voxels' % (reader.num_left, num_voxels))
    numbers = np.zeros(num_voxels, np.int64)
    for byte in range(num_bytes):
        numbers |= reader.take(np.uint8, num_voxels).astype(np.int64) << 8 * byte
    if num_voxels and numbers.max() >= len(values):
        raise DamagedMessage('a voxel has no log-odds')
    return values[numbers]


def _spread(bounds, values):
    """The log-odds of a brick by voxel. bounds: of its cuboids, from its least voxel."""
    log_odds = np.full((_EDGE, _EDGE, _EDGE), np.nan, np.float32)
    begin = 0
    for x0, y0, z0, x1, y1, z1 in bounds:
        size = (int(z1) - z0, int(y1) - y0, int(x1) - x0)
        end = begin + size[0] * size[1] * size[2]
        log_odds[z0:z1, y0:y1, x0:x1] = values[begin:end].reshape(size)
        begin = end
    return log_odds.reshape(-1)


def _unpack(message):
    """The bricks of a CuboidBricks: pairs of a least voxel and a _Brick. Raises DamagedMessage."""
    try:
        reader = _Reader(zlib.decompress(bytes(message.data)))
        least = reader.take('<i4', 3 * message.num_bricks).reshape(-1, 3)
        counts = reader.take('<u2', message.num_bricks).astype(np.int64)
        offsets = reader.take(np.uint8, 6 * message.num_cuboids).reshape(-1, 6)
        occupied = reader.take(np.uint8, message.num_cuboids) != 0
    except (zlib.error, ValueError) as error:
        raise DamagedMessage(str(error)) from error
    ends = np.cumsum(counts)
    if counts.sum() != message.num_cuboids or (least % _EDGE != 0).any() or \
            (offsets[:, :3] >= offsets[:, 3:]).any() or (offsets[:, 3:] > _EDGE).any():
        raise DamagedMessage('its cuboids lie in no bricks')
    bounds = (offsets + np.tile(np.repeat(least, counts, axis=0), 2)).astype(np.int32)
    volumes = _volumes(offsets)
    values = _read_values(message, reader, int(volumes.sum())) if message.has_values else None
    if reader.num_left:
        raise DamagedMessage('something follows its end')
    last_voxels = np.concatenate([[0], np.cumsum(volumes)])
    bricks = []
    for brick, begin, end in zip(least, ends - counts, ends):
        log_odds = None
        if values is not None:
            log_odds = _spread(offsets[begin:end], values[last_voxels[begin]:last_voxels[end]])
        bricks.append((tuple(int(value) for value in brick),
                       _Brick(bounds[begin:end], occupied[begin:end], log_odds)))
    return bricks


class MapCopy:
    """A map in numpy arrays. Not thread-safe.

    It is kept brick by brick (cubes of 8 x 8 x 8 voxels). Every voxel has the class that it has in the map, and its
    log-odds where these travel (~publish_values, or GetMap with_values).
    """

    def __init__(self):
        self.instance = None
        self.revision = 0
        self.resolution = None
        self._bricks = {}

    def take_map(self, message):
        """Takes a FullCuboidMap, unless it is older than the copy. Raises DamagedMessage; the copy is then as it was."""
        if message.instance == self.instance and message.revision < self.revision:
            return
        bricks = dict(_unpack(message.bricks))
        self.instance, self.revision = message.instance, message.revision
        self.resolution = message.resolution
        self._bricks = {brick: content for brick, content in bricks.items() if len(content.occupied)}

    def take_update(self, message):
        """Takes a CuboidMapUpdate.

        Returns False when a FullCuboidMap is needed: there was none yet, updates were lost, or this one is damaged.
        """
        if message.instance != self.instance:
            return False
        if message.revision <= self.revision:
            return True
        if message.base > self.revision or message.everything:
            return False
        try:
            bricks = _unpack(message.bricks)
        except DamagedMessage:
            return False
        for brick, content in bricks:
            if len(content.occupied):
                self._bricks[brick] = content
            else:
                self._bricks.pop(brick, None)
        self.revision = message.revision
        return True

    def cuboids(self, low=None, high=None):
        """All cuboids, or the parts of them in the box of voxels [low, high)."""
        if low is None:
            return self._join(self._bricks.values())
        low, high = np.asarray(low), np.asarray(high)
        return _cut(self._join(self._bricks_in(low, high)), low, high)

    def log_odds_at(self, voxel):
        """Log-odds of a voxel, three whole numbers; None when it is unknown, or log-odds do not travel."""
        cell = np.asarray(voxel, np.int64)
        content = self._bricks.get(tuple(int(value) for value in cell // _EDGE * _EDGE))
        if content is None or content.log_odds is None:
            return None
        x, y, z = cell % _EDGE
        value = content.log_odds[64 * z + 8 * y + x]
        return None if np.isnan(value) else float(value)

    def voxels_of(self, low_m, high_m):
        """The box of voxels that a box in metres overlaps, as two arrays of three."""
        low = np.floor(np.asarray(low_m) / self.resolution + 1e-6).astype(np.int64)
        high = np.ceil(np.asarray(high_m) / self.resolution - 1e-6).astype(np.int64)
        return low, high

    def count(self, low_m, high_m):
        """Free, occupied and unknown voxels of a box in metres; unknown includes outside the map."""
        low, high = self.voxels_of(low_m, high_m)
        found = self.cuboids(low, high)
        volumes = _volumes(found.bounds)
        occupied = int(volumes[found.occupied].sum())
        free = int(volumes.sum()) - occupied
        return free, occupied, int(np.prod(high - low)) - free - occupied

    @staticmethod
    def _join(bricks):
        bricks = list(bricks)
        if not bricks:
            return Cuboids(np.empty((0, 6), np.int32), np.empty(0, bool))
        return Cuboids(np.concatenate([brick.bounds for brick in bricks]),
                       np.concatenate([brick.occupied for brick in bricks]))

    def _bricks_in(self, low, high):
        """Those that share a voxel with a box: looked up one by one, or among all, whichever is less."""
        first = low // _EDGE * _EDGE
        if np.prod((high - first + _EDGE - 1) // _EDGE) > len(self._bricks):
            return [content for brick, content in self._bricks.items()
                    if all(brick[axis] < high[axis] and brick[axis] + _EDGE > low[axis] for axis in range(3))]
        ranges = [range(int(first[axis]), int(high[axis]), _EDGE) for axis in range(3)]
        places = ((x, y, z) for x in ranges[0] for y in ranges[1] for z in ranges[2])
        return [self._bricks[place] for place in places if place in self._bricks]
