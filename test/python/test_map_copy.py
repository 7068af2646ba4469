#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The Python copy of a map against a dictionary of voxels. Needs neither ROS nor a build."""
import importlib.util
import itertools
import os
import random
import struct
import unittest
import zlib
from types import SimpleNamespace

_FILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'python',
                     'cuboid_mapping_client', 'map_copy.py')
_SPEC = importlib.util.spec_from_file_location('map_copy', _FILE)
map_copy = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(map_copy)

SEED = int(os.environ.get('CUBOID_MAPPING_TEST_SEED', '1'))
# Around a border of the chunks that the copy is kept in.
LOW, HIGH = (-10, -6, 120), (10, 6, 136)


def cells(bounds):
    return itertools.product(*(range(bounds[axis], bounds[axis + 3]) for axis in range(3)))


class Server:
    """A map that is edited at random."""

    def __init__(self):
        self.random = random.Random(SEED)
        self.revision = 0
        self.voxels = {}

    def random_box(self, within):
        low, high = [], []
        for axis in range(3):
            first = self.random.randrange(within[axis], within[axis + 3])
            low.append(first)
            high.append(self.random.randrange(first + 1, within[axis + 3] + 1))
        return low + high

    def edit(self):
        """Replaces what is in one box. Returns the update."""
        box = self.random_box(LOW + HIGH)
        inner = self.random_box(box) if self.random.random() < 0.7 else None
        value = self.random.choice([-1.0, 1.0])
        for cell in cells(box):
            self.voxels.pop(cell, None)
        if inner:
            self.voxels.update((cell, value) for cell in cells(inner))
        self.revision += 1
        count = 1 if inner else 0
        offsets = [inner[i] - box[i % 3] for i in range(6)] if inner else []
        data = struct.pack('<6iI', *box, count) + bytes(offsets) + bytes([1, 0] * count)
        return SimpleNamespace(
            instance=5, base=self.revision - 1, revision=self.revision, everything=False,
            resolution=0.1, num_boxes=1, num_cuboids=count, values=[7.0, value],
            data=zlib.compress(data))

    def map(self):
        bounds = [c for cell in self.voxels for c in cell + tuple(i + 1 for i in cell)]
        return SimpleNamespace(instance=5, revision=self.revision, resolution=0.1, bounds=bounds,
                               log_odds=list(self.voxels.values()))


def to_voxels(cuboids):
    voxels = {}
    for bounds, value in zip(cuboids.bounds, cuboids.log_odds):
        for cell in cells(bounds):
            assert cell not in voxels, 'not disjoint'
            voxels[cell] = value
    return voxels


class MapCopyTest(unittest.TestCase):

    def test_equals_the_map_after_any_stream_of_updates(self):
        print('CUBOID_MAPPING_TEST_SEED=%d' % SEED)
        server, copy = Server(), map_copy.MapCopy()
        num_gaps = num_compared = 0
        for _ in range(300):
            update = server.edit()
            if server.random.random() < 0.1:
                continue  # lost
            for _ in range(server.random.choice([1, 1, 1, 2])):
                if not copy.take_update(update):
                    num_gaps += 1
                    copy.take_map(server.map())
            self.assertEqual(copy.revision, server.revision)
            self.assertEqual(to_voxels(copy.cuboids()), server.voxels)
            num_compared += 1
        self.assertGreater(num_compared, 200)
        self.assertGreater(num_gaps, 10)

    def test_counts_voxels_of_a_box(self):
        server, copy = Server(), map_copy.MapCopy()
        for _ in range(30):
            server.edit()
        copy.take_map(server.map())
        for _ in range(300):
            box = server.random_box(LOW + HIGH)
            values = [server.voxels.get(cell) for cell in cells(box)]
            expected = (values.count(-1.0), values.count(1.0), values.count(None))
            low_m = [0.1 * value + server.random.uniform(0.0, 0.09) for value in box[:3]]
            high_m = [0.1 * value - server.random.uniform(0.0, 0.005) for value in box[3:]]
            self.assertEqual(copy.count(low_m, high_m), expected)

    def test_leaves_out_what_is_old(self):
        server, copy = Server(), map_copy.MapCopy()
        old = server.map()
        first = server.edit()
        self.assertFalse(copy.take_update(first), 'there is no map yet')
        copy.take_map(server.map())
        copy.take_map(old)
        self.assertEqual(copy.revision, 1)
        second, third = server.edit(), server.edit()
        self.assertFalse(copy.take_update(third), 'the second is missing')
        self.assertTrue(copy.take_update(second))
        self.assertTrue(copy.take_update(third))
        self.assertTrue(copy.take_update(second), 'once more')
        self.assertEqual(to_voxels(copy.cuboids()), server.voxels)
        third.instance = 6
        self.assertFalse(copy.take_update(third))


if __name__ == '__main__':
    unittest.main()
