# SPDX-License-Identifier: BSD-3-Clause
"""Compares cuboid_map.MapFollower with a dictionary of voxels. Needs no ROS: builds messages byte by byte."""
import itertools
import os
import random
import struct
import unittest
import zlib
from types import SimpleNamespace

import numpy as np
from cuboid_map import DamagedMessage, MapFollower

SEED = int(os.environ.get('CUBOID_MAPPING_TEST_SEED', '1'))
LOW, HIGH = (-10, -6, 120), (10, 6, 136)
# More than one byte can number.
LOG_ODDS = [np.float32(0.0093 * number - 2.5) for number in range(600)]


def cells(bounds):
    return itertools.product(*(range(bounds[axis], bounds[axis + 3]) for axis in range(3)))


def brick_of(cell):
    return tuple(value // 8 * 8 for value in cell)


def zigzag(number):
    return 2 * number if number >= 0 else -2 * number - 1


def varint(number):
    data = b''
    while number >= 0x80:
        data += bytes([number & 0x7F | 0x80])
        number >>= 7
    return data + bytes([number])


def to_mask(bits):
    return sum(1 << place for place, bit in enumerate(bits) if bit).to_bytes(64, 'little')


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
        """Replaces the voxels of one box. Returns the update."""
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
        return self.parts(1)[0]

    def parts(self, num_parts):
        bricks = sorted({brick_of(cell) for cell in self.voxels})
        return [SimpleNamespace(instance=self.instance, revision=self.revision, resolution=0.1, part=part, num_parts=num_parts,
                                bricks=self.pack(bricks[part::num_parts])) for part in range(num_parts)]

    def pack(self, bricks):
        """CuboidBricks message of these bricks."""
        known, occupied, log_odds = b'', b'', []
        for brick in bricks:
            voxels = [self.voxels.get(tuple(brick[axis] + offset[axis] for axis in range(3)))
                      for offset in ((x, y, z) for z in range(8) for y in range(8) for x in range(8))]
            known += to_mask(value is not None for value in voxels)
            occupied += to_mask(value is not None and value >= 0 for value in voxels)
            log_odds += [value for value in voxels if value is not None]
        values = sorted(set(log_odds)) if self.with_values else []
        data = struct.pack('<%df' % len(values), *values)
        for axis in range(3):
            numbers = [0] + [brick[axis] // 8 for brick in bricks]
            data += b''.join(varint(zigzag(b - a)) for a, b in zip(numbers, numbers[1:]))
        data += known
        if self.with_values:
            numbers = {value: varint(number) for number, value in enumerate(values)}
            data += b''.join(numbers[value] for value in log_odds)
        else:
            data += occupied
        return SimpleNamespace(num_bricks=len(bricks), has_values=self.with_values, num_values=len(values),
                               data=zlib.compress(data))


def to_classes(cuboids):
    voxels = {}
    for bounds, occupancy in zip(cuboids.cells, cuboids.occupancy):
        for cell in cells(bounds):
            assert cell not in voxels, 'not disjoint'
            voxels[cell] = occupancy == 2
    return voxels


class MapFollowerTest(unittest.TestCase):

    def expect_same(self, copy, server):
        self.assertEqual(copy.revision, server.revision)
        self.assertEqual(to_classes(copy.cuboids()), {cell: bool(value >= 0) for cell, value in server.voxels.items()})
        if not server.with_values:
            return
        some = list(itertools.islice(cells(LOW + HIGH), 0, None, 7))
        expected = [server.voxels.get(cell, np.nan) for cell in some]
        np.testing.assert_array_equal(copy.log_odds(0.1 * (np.array(some) + 0.5)), np.array(expected, np.float32))

    def test_equals_the_map_after_any_stream_of_updates(self):
        print('CUBOID_MAPPING_TEST_SEED=%d' % SEED)
        for with_values in (False, True):
            server, copy = Server(with_values), MapFollower()
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
        server, copy = Server(True), MapFollower()
        for number, cell in enumerate(itertools.islice(cells(LOW + HIGH), 600)):
            server.voxels[cell] = LOG_ODDS[number]
        copy.take_map(server.map())
        self.expect_same(copy, server)

    def test_cannot_be_asked_before_the_first_map(self):
        copy = MapFollower()
        self.assertEqual((copy.has_map, copy.revision, copy.instance), (False, 0, 0))
        for ask in (copy.cuboids, lambda: copy.classify([(0, 0, 0)]), lambda: copy.resolution):
            with self.assertRaisesRegex(RuntimeError, 'no map has come yet'):
                ask()
        server = Server(False)
        server.edit()
        copy.take_map(server.map())
        self.assertEqual((copy.has_map, copy.instance, copy.resolution), (True, 5, 0.1))

    def test_takes_arrays_and_lists_as_they_come_from_ros(self):
        for convert in (list, bytearray, lambda data: np.frombuffer(data, np.uint8)):
            server, copy = Server(True), MapFollower()
            for _ in range(5):
                server.edit()
            message = server.map()
            message.bricks.data = convert(message.bricks.data)
            copy.take_map(message)
            self.expect_same(copy, server)
        with self.assertRaises(AttributeError):
            copy.take_map(SimpleNamespace(instance=1, revision=1, resolution=0.1))

    def test_takes_the_parts_of_a_large_map(self):
        server, copy = Server(True), MapFollower()
        for _ in range(20):
            server.edit()
        parts = server.parts(3)
        for wrong in (parts[0], parts[:-1], parts[::-1], []):
            self.assertRaises(DamagedMessage, copy.take_map, wrong)
        copy.take_map(parts)
        self.expect_same(copy, server)

    def test_has_the_frame_of_the_map(self):
        server, copy = Server(False), MapFollower()
        server.edit()
        message = server.map()
        message.header = SimpleNamespace(frame_id='hall', stamp=SimpleNamespace(to_nsec=lambda: 0))
        copy.take_map(message)
        self.assertEqual((copy.frame_id, copy.copy().frame_id), ('hall', 'hall'))

    def test_leaves_out_what_is_old(self):
        server, copy = Server(True), MapFollower()
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
        server, copy = Server(True), MapFollower()
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
        server, copy = Server(True), MapFollower()
        for _ in range(20):
            server.edit()
        copy.take_map(server.map())
        num_refused = 0
        for damage in (lambda bricks: setattr(bricks, 'data', bricks.data[:-4]),
                       lambda bricks: setattr(bricks, 'data', b''),
                       lambda bricks: setattr(bricks, 'num_values', bricks.num_values + 1),
                       lambda bricks: setattr(bricks, 'num_bricks', bricks.num_bricks - 1),
                       lambda bricks: setattr(bricks, 'num_bricks', 1 << 31),
                       lambda bricks: setattr(bricks, 'num_values', 0),
                       lambda bricks: setattr(bricks, 'has_values', False)):
            damaged = server.map()
            damaged.revision += 1
            damage(damaged.bricks)
            with self.assertRaises(DamagedMessage):
                copy.take_map(damaged)
            damaged.base, damaged.everything = server.revision, False
            self.assertFalse(copy.take_update(damaged))
            self.expect_same(copy, server)
            num_refused += 1
        self.assertEqual(num_refused, 7)

