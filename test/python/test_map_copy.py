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

import numpy as np

_FILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'python',
                     'cuboid_mapping_client', 'map_copy.py')
_SPEC = importlib.util.spec_from_file_location('map_copy', _FILE)
map_copy = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(map_copy)

SEED = int(os.environ.get('CUBOID_MAPPING_TEST_SEED', '1'))
LOW, HIGH = (-10, -6, 120), (10, 6, 136)
# More than can be named by one byte.
LOG_ODDS = [np.float32(0.0093 * number - 2.5) for number in range(600)]


def cells(bounds):
    return itertools.product(*(range(bounds[axis], bounds[axis + 3]) for axis in range(3)))


def brick_of(cell):
    return tuple(value // 8 * 8 for value in cell)


class Server:
    """A map that is edited at random."""

    def __init__(self, with_values, instance=5):
        self.random = random.Random(SEED)
        self.with_values = with_values
        self.instance = instance
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
        for cell in cells(box):
            self.voxels.pop(cell, None)
        if inner:
            sign = self.random.choice([-1, 1])
            self.voxels.update((cell, sign * abs(self.random.choice(LOG_ODDS))) for cell in cells(inner))
        self.revision += 1
        bricks = sorted({brick_of(cell) for cell in cells(box)})
        return SimpleNamespace(
            instance=self.instance, base=self.revision - 1, revision=self.revision, everything=False,
            resolution=0.1, bricks=self.pack(bricks))

    def map(self):
        bricks = sorted({brick_of(cell) for cell in self.voxels})
        return SimpleNamespace(instance=self.instance, revision=self.revision, resolution=0.1,
                               bricks=self.pack(bricks))

    def pack(self, bricks):
        """A CuboidBricks of these bricks, with rows of voxels along x as cuboids."""
        counts, offsets, occupied, log_odds = [], [], [], []
        for brick in bricks:
            rows = list(self.rows(brick))
            counts.append(len(rows))
            for x, y, z, values in rows:
                offsets += [x, y, z, x + len(values), y + 1, z + 1]
                occupied.append(int(values[0] >= 0))
                log_odds += values
        values = sorted(set(log_odds))
        data = struct.pack('<%di' % (3 * len(bricks)), *(value for brick in bricks for value in brick))
        data += struct.pack('<%dH' % len(counts), *counts) + bytes(offsets) + bytes(occupied)
        if self.with_values:
            numbers = [values.index(value) for value in log_odds]
            data += bytes(number & 0xFF for number in numbers)
            if len(values) > 256:
                data += bytes(number >> 8 for number in numbers)
        return SimpleNamespace(num_bricks=len(bricks), num_cuboids=len(occupied), has_values=self.with_values,
                               values=values if self.with_values else [], data=zlib.compress(data))

    def rows(self, brick):
        """The known voxels of a brick, rows of one class: least x, y, z from the brick, and log-odds along x."""
        for z, y in itertools.product(range(8), range(8)):
            row = [self.voxels.get((brick[0] + x, brick[1] + y, brick[2] + z)) for x in range(8)]
            for key, group in itertools.groupby(range(8), lambda x: row[x] is not None and (row[x] >= 0) + 1):
                if key:
                    places = list(group)
                    yield places[0], y, z, [row[x] for x in places]


def to_classes(cuboids):
    voxels = {}
    for bounds, is_occupied in zip(cuboids.bounds, cuboids.occupied):
        for cell in cells(bounds):
            assert cell not in voxels, 'not disjoint'
            voxels[cell] = bool(is_occupied)
    return voxels


class MapCopyTest(unittest.TestCase):

    def expect_same(self, copy, server):
        self.assertEqual(copy.revision, server.revision)
        self.assertEqual(to_classes(copy.cuboids()), {cell: bool(value >= 0) for cell, value in server.voxels.items()})
        for cell in itertools.islice(cells(LOW + HIGH), 0, None, 7):
            expected = server.voxels.get(cell) if server.with_values else None
            self.assertEqual(copy.log_odds_at(cell), expected, cell)

    def test_equals_the_map_after_any_stream_of_updates(self):
        print('CUBOID_MAPPING_TEST_SEED=%d' % SEED)
        for with_values in (False, True):
            server, copy = Server(with_values), map_copy.MapCopy()
            num_gaps = num_compared = 0
            for _ in range(300):
                update = server.edit()
                if server.random.random() < 0.1:
                    continue  # lost
                for _ in range(server.random.choice([1, 1, 1, 2])):
                    if not copy.take_update(update):
                        num_gaps += 1
                        copy.take_map(server.map())
                self.expect_same(copy, server)
                num_compared += 1
            self.assertGreater(num_compared, 200)
            self.assertGreater(num_gaps, 10)

    def test_names_more_than_256_log_odds(self):
        server, copy = Server(True), map_copy.MapCopy()
        for number, cell in enumerate(itertools.islice(cells(LOW + HIGH), 600)):
            server.voxels[cell] = LOG_ODDS[number]
        copy.take_map(server.map())
        self.expect_same(copy, server)

    def test_counts_voxels_of_a_box(self):
        server, copy = Server(False), map_copy.MapCopy()
        for _ in range(30):
            server.edit()
        copy.take_map(server.map())
        for _ in range(300):
            box = server.random_box(LOW + HIGH)
            values = [server.voxels.get(cell) for cell in cells(box)]
            free = sum(value is not None and value < 0 for value in values)
            expected = (free, len(values) - free - values.count(None), values.count(None))
            low_m = [0.1 * value + server.random.uniform(0.0, 0.09) for value in box[:3]]
            high_m = [0.1 * value - server.random.uniform(0.0, 0.005) for value in box[3:]]
            self.assertEqual(copy.count(low_m, high_m), expected)
        known = len(server.voxels)
        counts = copy.count((-100, -100, -100), (100, 100, 100))
        self.assertEqual(counts[0] + counts[1], known, 'a box much larger than the map')

    def test_leaves_out_what_is_old(self):
        server, copy = Server(True), map_copy.MapCopy()
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
        self.expect_same(copy, server)
        third.revision, third.everything = third.revision + 1, True
        self.assertFalse(copy.take_update(third), 'the map was replaced')
        self.expect_same(copy, server)

    def test_follows_a_server_that_was_started_anew(self):
        server, copy = Server(True), map_copy.MapCopy()
        for _ in range(20):
            server.edit()
        copy.take_map(server.map())
        other = Server(True, instance=6)
        update = other.edit()
        self.assertFalse(copy.take_update(update), 'of another map, though its revision is less')
        copy.take_map(other.map())
        self.expect_same(copy, other)
        self.assertTrue(copy.take_update(other.edit()))
        self.expect_same(copy, other)

    def test_is_as_it_was_after_a_damaged_message(self):
        server, copy = Server(True), map_copy.MapCopy()
        for _ in range(20):
            server.edit()
        copy.take_map(server.map())
        num_refused = 0
        for damage in (lambda bricks: setattr(bricks, 'data', bricks.data[:-4]),
                       lambda bricks: setattr(bricks, 'data', b''),
                       lambda bricks: setattr(bricks, 'num_cuboids', bricks.num_cuboids + 1),
                       lambda bricks: setattr(bricks, 'num_bricks', bricks.num_bricks - 1),
                       lambda bricks: setattr(bricks, 'num_bricks', 1 << 31),
                       lambda bricks: setattr(bricks, 'values', bricks.values[:-1]),
                       lambda bricks: setattr(bricks, 'has_values', False)):
            damaged = server.map()
            damaged.revision += 1
            damage(damaged.bricks)
            with self.assertRaises(map_copy.DamagedMessage):
                copy.take_map(damaged)
            damaged.base, damaged.everything = server.revision, False
            self.assertFalse(copy.take_update(damaged))
            self.expect_same(copy, server)
            num_refused += 1
        self.assertEqual(num_refused, 7)


if __name__ == '__main__':
    unittest.main()
