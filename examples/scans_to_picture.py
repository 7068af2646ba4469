# SPDX-License-Identifier: BSD-3-Clause
"""Maps a folder of scans and draws a picture, in cells (# %%) for an editor that runs them one by one.

usage: scans_to_picture.py [FOLDER [PICTURE.png]]

FOLDER has scans/NNNN.pcd, and poses.txt with a line `index tx ty tz qx qy qz qw` for each scan (map <- sensor).
Without FOLDER, a sensor is simulated in two rooms.
Needs numpy and cuboid_map.
"""
# %% Imports
import pathlib
import struct
import sys
import tempfile
import zlib

import cuboid_map
import numpy as np

if '--help' in sys.argv:
    sys.exit(print(__doc__))
folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(tempfile.mkdtemp())
picture = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else folder / 'map.png'


# %% Scans are read one by one: points in the sensor's frame, and the pose of the sensor
def to_matrix(x, y, z, qx, qy, qz, qw):
    pose = np.eye(4)
    pose[:3, :3] = [[1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw)],
                    [2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw)],
                    [2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy)]]
    pose[:3, 3] = x, y, z
    return pose


def read_pcd(file):
    """Reads the points of a binary .pcd with the fields x, y and z."""
    content = file.read_bytes()
    head, mark, data = content.partition(b'DATA binary\n')
    if not mark or b'FIELDS x y z\n' not in head:
        raise ValueError(f'{file}: only binary files with the fields x y z can be read here')
    return np.frombuffer(data, np.float32).reshape(-1, 3)


def read_scans(source):
    for line in (source / 'poses.txt').read_text().splitlines():
        if line.startswith('#'):
            continue
        index, *numbers = line.split()
        yield read_pcd(source / 'scans' / f'{int(index):04}.pcd'), to_matrix(*map(float, numbers))


# %% Without a folder: two rooms with a door between them, seen from nine places
def simulate(target, num_beams=20000):
    # Boxes: min x, y, z, max x, y, z. The hall is seen from inside, the others from outside.
    boxes = np.array([(0, 0, 0, 10, 6, 2.5), (4.9, 0, 0, 5.1, 2.5, 2.5), (4.9, 3.5, 0, 5.1, 6, 2.5),
                      (1, 4, 0, 2, 5, 1), (7, 1, 0, 7.5, 1.5, 2.5), (8.5, 4, 0, 9.5, 5, 1.5)])
    directions = np.random.default_rng(1).normal(size=(num_beams, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    (target / 'scans').mkdir(parents=True, exist_ok=True)
    lines = ['# index tx ty tz qx qy qz qw   (map <- sensor)']
    for index, x in enumerate(np.linspace(1, 9, 9)):
        origin = np.array([x, 3.0, 1.2])
        near, far = [(boxes[:, None, part] - origin) / directions for part in (slice(0, 3), slice(3, 6))]
        enter, leave = np.minimum(near, far).max(axis=2), np.maximum(near, far).min(axis=2)
        ranges = np.where((enter > 0) & (enter < leave), enter, np.inf)[1:].min(axis=0)
        points = (directions * np.minimum(ranges, leave[0])[:, None]).astype(np.float32)
        head = (f'VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {num_beams}\nHEIGHT 1\n'
                f'VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {num_beams}\nDATA binary\n')
        (target / 'scans' / f'{index:04}.pcd').write_bytes(head.encode() + points.tobytes())
        lines.append(f'{index} {x} 3 1.2 0 0 0 1')
    (target / 'poses.txt').write_text('\n'.join(lines) + '\n')


if len(sys.argv) == 1:
    simulate(folder)

# %% The map
mapper = cuboid_map.Mapper(resolution=0.1, max_range=20, threads=0)
for points, pose in read_scans(folder):
    mapper.integrate(points, pose)
free, occupied = mapper.cuboids(classes='free'), mapper.cuboids(classes='occupied')
print(f'{len(free.boxes)} free and {len(occupied.boxes)} occupied cuboids, {mapper.num_bytes / 1e6:.1f} MB')
mapper.save(str(picture.with_suffix('.cuboids')))

# %% A picture from above: height of the occupied voxels of each column, and free space
low, high = occupied.boxes[:, :3].min(axis=0), occupied.boxes[:, 3:].max(axis=0)
# The part between floor and ceiling.
height = high[2] - low[2]
low[2], high[2] = low[2] + 0.1 * height, high[2] - 0.1 * height
voxels = mapper.dense(np.hstack([low, high]))
is_occupied = voxels == cuboid_map.Occupancy.OCCUPIED
top = np.where(is_occupied, np.arange(voxels.shape[2]), 0).max(axis=2) / max(1, voxels.shape[2] - 1)
image = np.full(voxels.shape[:2] + (3,), 96, np.uint8)  # Grey: unknown.
image[(voxels == cuboid_map.Occupancy.FREE).any(axis=2)] = 255
wall = is_occupied.any(axis=2)
image[wall] = np.stack([40 + 180 * top, 60 + 0 * top, 200 - 180 * top], axis=2)[wall].astype(np.uint8)
image = image.transpose(1, 0, 2)[::-1]  # x to the right, y upwards.


# %% Write the picture to a file (in a notebook: plt.imshow(image))
def write_png(file, rgb):
    def chunk(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))

    rows = np.hstack([np.zeros((rgb.shape[0], 1), np.uint8), rgb.reshape(rgb.shape[0], -1)])
    head = struct.pack('>IIBBBBB', rgb.shape[1], rgb.shape[0], 8, 2, 0, 0, 0)
    file.write_bytes(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', head) + chunk(b'IDAT', zlib.compress(rows.tobytes()))
                     + chunk(b'IEND', b''))


write_png(picture, np.repeat(np.repeat(image, 4, axis=0), 4, axis=1))
print(f'{picture}: {len(image)} rows and {len(image[0])} columns of voxels')
