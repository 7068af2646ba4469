# SPDX-License-Identifier: BSD-3-Clause
"""scripts/data_set: data sets from checkouts that have the form of the public sources, and a few points."""
import pathlib
import subprocess
import sys

import cuboid_map
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

ROOT = pathlib.Path(__file__).resolve().parents[2]


def make(name, checkout, folder, *options):
    return subprocess.run([sys.executable, ROOT / 'scripts' / 'data_set', name, checkout, folder, *options], capture_output=True, text=True)


def read_scan(folder, index):
    content = (folder / 'scans' / f'{index:04d}.pcd').read_bytes()
    return np.frombuffer(content[content.index(b'DATA binary\n') + 12:], '<f4').reshape(-1, 3)


def read_poses(folder):
    return np.atleast_2d(np.loadtxt(folder / 'poses.txt'))


def write_image(file, rows):
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.array(rows, dtype=np.uint16)).save(file)


def test_depth_images_become_points_in_a_map_with_z_up(tmp_path):
    data = tmp_path / 'source' / 'data'
    for frame in range(0, 1000, 500):
        write_image(data / f'frame-{frame:06d}.depth.png', [[0, 2000], [65535, 1000]])
        turned = np.eye(4)
        turned[:3, 3] = 1, 2, 3 + frame
        np.savetxt(data / f'frame-{frame:06d}.pose.txt', turned)
    np.savetxt(data / 'camera-intrinsics.txt', [[2, 0, 1], [0, 4, 0], [0, 0, 1]])
    done = make('rgbd_7scenes', tmp_path / 'source', tmp_path / 'set', '--every', '500')
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(read_scan(tmp_path / 'set', 1), [[0, 0, 2], [0, 0.25, 1]])
    poses = read_poses(tmp_path / 'set')
    np.testing.assert_allclose(poses[:, 1:4], [[1, 3, -2], [1, 503, -2]])
    np.testing.assert_allclose(Rotation.from_quat(poses[0, 4:]).apply([0, 1, 0]), [0, 0, -1], atol=1e-6)


def test_range_images_become_points_around_the_car(tmp_path):
    folder = tmp_path / 'source' / 'exampleData/MuehlburgerTor/velodyne_dist'
    for frame in range(0, 176, 88):
        write_image(folder / f'data/{frame:010d}.png', [[0, 500, 0, 0], [0, 0, 0, 1000 + frame]])
    (folder / 'velodyne_config.txt').write_text('# multiplier, columns, rows, ...\n500 4 2 180 -180 0 30\n')
    done = make('muehlburger_tor_standing', tmp_path / 'source', tmp_path / 'set', '--every', '88')
    assert done.returncode == 0, done.stderr
    # The middles of the columns look 135, 45, -45 and -135 degrees to the left; the second row 30 degrees below the horizon.
    half = np.sqrt(0.5)
    np.testing.assert_allclose(read_scan(tmp_path / 'set', 0),
                               [[half, half, 0], [-2 * half * np.sqrt(0.75), -2 * half * np.sqrt(0.75), -1]], atol=0.0006)
    np.testing.assert_array_equal(read_poses(tmp_path / 'set')[1], [1, 0, 0, 0, 0, 0, 0, 1])


@pytest.fixture
def kitti(tmp_path):
    """Each frame has a point ahead, one behind to the left, one behind to the right, and one without a return."""
    folder = tmp_path / 'kitti' / 'src/sensors/data/pcd/data_2'
    folder.mkdir(parents=True)
    points = np.array([[10, 0, 0, 1], [-10, 0.001, 1, 1], [-10, -0.001, 1, 1], [0, 0, 0, 0]], dtype='<f4')
    for frame in range(154):
        (folder / f'{frame:010d}.pcd').write_bytes(b'FIELDS x y z intensity\nPOINTS 4\nDATA binary\n' + points.tobytes() + bytes(8))
    return tmp_path / 'kitti'


def test_points_of_a_turning_lidar_move_to_the_middle_of_its_turn(tmp_path, kitti):
    done = make('kitti_0005_city', kitti, tmp_path / 'set')
    assert done.returncode == 0, done.stderr
    table = np.loadtxt(ROOT / 'benchmark/data_sets/kitti_0005_city.txt')
    np.testing.assert_allclose(read_poses(tmp_path / 'set')[:, 1:], table[:, 1:8], atol=2e-9)
    turn, speed = table[25, 8:11], table[25, 11:14]
    ahead, first, last = read_scan(tmp_path / 'set', 25)
    np.testing.assert_array_equal(ahead, [10, 0, 0])
    # The turn begins behind on the left: half a turn before its middle.
    np.testing.assert_allclose(first, Rotation.from_rotvec(-turn / 2).apply([-10, 0.001, 1]) - speed / 2, atol=0.0006)
    np.testing.assert_allclose(last, Rotation.from_rotvec(turn / 2).apply([-10, -0.001, 1]) + speed / 2, atol=0.0006)


def test_poses_between_those_of_the_table_follow_its_speed(tmp_path, kitti):
    done = make('kitti_0005_city', kitti, tmp_path / 'set', '--every', '1')
    assert done.returncode == 0, done.stderr
    table, poses = np.loadtxt(ROOT / 'benchmark/data_sets/kitti_0005_city.txt'), read_poses(tmp_path / 'set')
    assert len(poses) == 151
    np.testing.assert_allclose(poses[::6, 1:], table[:, 1:8], atol=2e-9)
    speeds = Rotation.from_quat(table[:-1, 4:8]).apply(table[:-1, 11:14])
    np.testing.assert_allclose(poses[1::6, 1:4] - poses[:-1:6, 1:4], speeds, atol=0.02)


def test_beams_of_the_simulated_lidar_end_in_walls_with_noise(tmp_path):
    """The map is free but for a wall; behind it, and beyond the map, nothing is known."""
    file = tmp_path / 'source' / 'octomap/share/data/geb079.bt'
    file.parent.mkdir(parents=True)
    mapper = cuboid_map.Mapper(resolution=0.08)
    mapper.set_boxes([[-7.91, -4, -2, 2, 4, 3]], 'free')
    mapper.set_boxes([[-7.99, -4, -2, -7.93, 4, 3]], 'occupied')
    mapper.save(str(file))
    done = make('sim_fr079', tmp_path / 'source', tmp_path / 'set', '--every', '33')
    assert done.returncode == 0, done.stderr
    pose = read_poses(tmp_path / 'set')[0]
    points = Rotation.from_quat(pose[4:]).apply(read_scan(tmp_path / 'set', 0)) + pose[1:4]
    assert len(points) > 10000
    across = points - pose[1:4]
    straight = points[np.linalg.norm(across[:, 1:], axis=1) < 0.1]  # Beams that pass both faces of the wall.
    assert len(straight) > 20
    assert np.mean(straight[:, 0]) == pytest.approx(-7.96, abs=0.005)
    assert 0.005 < np.std(straight[:, 0]) < 0.02


def test_a_folder_that_is_no_checkout_is_refused(tmp_path):
    done = make('rgbd_7scenes', tmp_path, tmp_path / 'set')
    assert done.returncode == 1
    assert 'camera-intrinsics.txt' in done.stderr and 'github.com/andyzeng/tsdf-fusion-python' in done.stderr
    assert not (tmp_path / 'set').exists()
    assert make('rgbd_7scenes', tmp_path, tmp_path / 'set', '--every', '0').returncode == 2
    (tmp_path / 'set').mkdir()
    done = make('rgbd_7scenes', tmp_path, tmp_path / 'set')
    assert done.returncode == 2 and 'exists' in done.stderr
