#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes version_2.cuboids after doc/file_format.md alone. Used once: the file does not change any more.

usage: write_version_2.py FILE
"""
import functools
import struct
import sys
import zlib


def log_odds_of_map():
    """The voxels of test/io/test_native_format.cpp, by cell."""
    voxels = {}
    for x in range(-8, -4):
        for y in range(8):
            for z in range(8, 16):
                voxels[x, y, z] = -0.5
    voxels[0, 0, 0] = 0.75
    for x in range(1, 8):
        voxels[x, 0, 0] = -0.5
    for x in range(1000000, 1000010):
        voxels[x, -1000000, 299] = 2.0
    for number in range(512):  # Enough that an index takes two bytes.
        if number % 3 != 0:
            voxels[-16 + number % 8, -16 + number // 8 % 8, -16 + number // 64] = (number - 256) / 64
    return voxels


def bricks_along_the_curve(voxels):
    def compare(a, b):
        # The axis with the highest differing bit decides; the first one on a tie.
        differences = [(p & 0xFFFFFFFF) ^ (q & 0xFFFFFFFF) for p, q in zip(a, b)]
        bits = [difference.bit_length() for difference in differences]
        axis = bits.index(max(bits))
        return a[axis] - b[axis]
    return sorted({tuple(value // 8 for value in cell) for cell in voxels}, key=functools.cmp_to_key(compare))


def varint(value):
    out = b''
    while value >= 0x80:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def zigzag(value):
    return 2 * value if value >= 0 else -2 * value - 1


def content(voxels, bricks, table):
    out = b''.join(struct.pack('<f', value) for value in table)
    for axis in range(3):
        before = 0
        for brick in bricks:
            out += varint(zigzag(brick[axis] - before))
            before = brick[axis]
    cells = [(x, y, z) for z in range(8) for y in range(8) for x in range(8)]
    places = b''
    for brick in bricks:
        mask = 0
        for number, cell in enumerate(cells):
            value = voxels.get(tuple(8 * brick[axis] + cell[axis] for axis in range(3)))
            if value is not None:
                mask |= 1 << number
                places += varint(table.index(value))
        out += mask.to_bytes(64, 'little')
    return out + places


def zstd_frame(raw):
    """One frame with one uncompressed block."""
    assert len(raw) < 1 << 17
    return struct.pack('<IBI', 0xFD2FB528, 0xA0, len(raw)) + (len(raw) << 3 | 1).to_bytes(3, 'little') + raw


def write(file):
    voxels = log_odds_of_map()
    bricks = bricks_along_the_curve(voxels)
    table = sorted(set(voxels.values()))
    raw = content(voxels, bricks, table)
    compressed = zstd_frame(raw)
    header = b'\x89CUB\r\n\x1a\n' + struct.pack(
        '<II5d4QI3s', 2, 1, 0.2, 0.7, 0.4, 0.12, 0.97, len(bricks), len(table), len(raw), len(compressed), 3, b'map')
    with open(file, 'wb') as out:
        for part in header, compressed:
            out.write(part + struct.pack('<I', zlib.crc32(part)))


write(sys.argv[1])
