# SPDX-License-Identifier: BSD-3-Clause
"""A 3D occupancy map of rectangular cuboids, for numpy.

    mapper = cuboid_map.Mapper(resolution=0.1, max_range=30)
    mapper.integrate(points, pose)              # (n, 3) in the sensor's frame, (4, 4)
    mapper.classify([(1, 0, 0.5)])              # array([1], dtype=uint8): FREE
    mapper.cuboids(classes='occupied').boxes    # (n, 6), metres

`Mapper` makes a map from scans, `MapFollower` follows the map of another process; both are a `Map`, which has the
queries. `MapFollower.copy()` keeps one revision. All lengths are in metres.
"""
from cuboid_map._core import (
    DamagedMessage, Map, MapCopy, MapFileError, MapFollower, Mapper, convert, find_no_return_beams)
from cuboid_map.results import (
    BoxCover, Boxes, Corridor, CorridorEnd, Cuboids, Distances, FreeBoxes, Frontiers, IntegratedScan, Motion, Nearest, Occupancy,
    Paths, PosePath, Poses, RayEnd, Rays)

__all__ = [
    'BoxCover', 'Boxes', 'Corridor', 'CorridorEnd', 'Cuboids', 'DamagedMessage', 'Distances', 'FreeBoxes',
    'Frontiers', 'IntegratedScan', 'Map', 'MapCopy', 'MapFileError', 'MapFollower', 'Mapper', 'Motion', 'Nearest', 'Occupancy', 'Paths', 'PosePath', 'Poses', 'RayEnd', 'Rays', 'convert', 'find_no_return_beams']
