# SPDX-License-Identifier: BSD-3-Clause
"""cuboid_map.Mapper: scans in, map out."""
import threading
import time

import cuboid_map
import numpy as np
import pytest
from cuboid_map import Occupancy
from scenes import ROOM, cells_of, pose_at, scan_room

POSES = [pose_at((0.01, 0.02, 0.03)), pose_at((0.81, -0.32, 0.33), 1.0), pose_at((-1.01, 0.52, 0.13), -2.0)]


def map_of_room(**config):
    mapper = cuboid_map.Mapper(**{'resolution': 0.1, **config})
    for seed, pose in enumerate(POSES):
        mapper.integrate(scan_room(pose, seed=seed), pose)
    return mapper


def voxels_of(cuboids):
    """The class of each voxel."""
    voxels = {}
    for box, occupancy in zip(cuboids.cells, cuboids.occupancy):
        for cell in np.ndindex(*(box[3:] - box[:3])):
            key = tuple(box[:3] + cell)
            assert key not in voxels, 'not disjoint'
            voxels[key] = occupancy
    return voxels


def test_a_scan_frees_the_space_up_to_its_points():
    mapper = cuboid_map.Mapper(resolution=0.1)
    scan = mapper.integrate([(1.0, 0.0, 0.0), (np.nan, 0.0, 0.0)], pose_at((0.05, 0.05, 0.05)))
    assert scan == (1, 1, 0)
    assert mapper.classify([(0.05 + 0.1 * x, 0.05, 0.05) for x in range(12)]).tolist() == \
        [Occupancy.FREE] * 10 + [Occupancy.OCCUPIED, Occupancy.UNKNOWN]
    np.testing.assert_allclose(mapper.log_odds([(0.05, 0.05, 0.05), (1.05, 0.05, 0.05)]),
                               [np.log(0.4 / 0.6), np.log(0.7 / 0.3)], atol=1e-5)
    assert np.isnan(mapper.log_odds([(5, 5, 5), (np.nan, 0, 0), (1e12, 0, 0)])).all()


def test_points_are_moved_by_the_pose_and_seen_from_its_origin():
    by_pose, moved = cuboid_map.Mapper(resolution=0.1), cuboid_map.Mapper(resolution=0.1)
    pose = pose_at((0.81, -0.32, 0.33), 1.0)
    points = scan_room(pose)
    by_pose.integrate(points, pose)
    moved.integrate((points @ pose[:3, :3].T + pose[:3, 3]), origin=pose[:3, 3])
    voxels, others = voxels_of(by_pose.cuboids()), voxels_of(moved.cuboids())
    assert len(voxels) > 1000
    # float32 and float64 differ at the borders of a few voxels.
    assert len(set(voxels.items()) ^ set(others.items())) < 0.02 * len(voxels)


def test_double_points_far_away_are_as_exact_as_near_the_origin():
    far = np.array([5572094.15, 466880.25, 330.05])
    points = np.column_stack([far[0] - 0.1 + 0.1 * np.arange(100), np.full(100, far[1] + 3.0), np.full(100, far[2])])
    mapper = cuboid_map.Mapper(resolution=0.1)
    mapper.integrate(points, origin=far)
    assert (mapper.classify(points) == Occupancy.OCCUPIED).all()
    no_returns = cuboid_map.Mapper(resolution=0.1)
    no_returns.integrate(np.zeros((0, 3)), origin=far, no_returns=points)
    assert (no_returns.classify(points) == Occupancy.FREE).all()


def test_double_points_that_would_be_rounded_are_refused():
    mapper = cuboid_map.Mapper(resolution=0.1)
    points = np.array([(5.0, 0.0, 0.0), (5572094.05, 466880.25, 330.0)])
    with pytest.raises(ValueError, match=r'points\[1\].*origin'):
        mapper.integrate(points)
    with pytest.raises(ValueError, match=r'no_returns\[1\]'):
        mapper.integrate(points[:1], no_returns=points)
    assert len(mapper.cuboids().cells) == 0


def test_the_walls_of_a_room_are_found():
    mapper = map_of_room()
    found = mapper.cuboids(classes='occupied')
    low, high = cells_of(ROOM[:3], 0.1), cells_of(ROOM[3:], 0.1)
    at_wall = (found.cells[:, :3] <= low + 1).any(axis=1) | (found.cells[:, 3:] >= high).any(axis=1)
    assert len(at_wall) > 100
    assert at_wall.all()


def test_memory_order_and_type_of_points_do_not_matter():
    points = scan_room(POSES[0])
    expected = cuboid_map.Mapper(resolution=0.1)
    expected.integrate(points, POSES[0])
    cloud = np.zeros((len(points), 5), np.float32)
    cloud[:, 1:4] = points
    for same in (points.astype(np.float64), np.asfortranarray(points), cloud[:, 1:4], points.tolist()):
        mapper = cuboid_map.Mapper(resolution=0.1)
        mapper.integrate(same, POSES[0].tolist())
        assert voxels_of(mapper.cuboids()) == voxels_of(expected.cuboids())


def test_max_range_and_beams_without_return_free_space():
    mapper = cuboid_map.Mapper(resolution=0.1, max_range=1.0)
    mapper.integrate([(3.0, 0.05, 0.05)], no_returns=np.array([(0.05, 0.75, 0.05)]), origin=(0.05, 0.05, 0.05))
    assert len(mapper.cuboids(classes='occupied').cells) == 0
    assert mapper.classify([(0.95, 0.05, 0.05), (1.25, 0.05, 0.05), (0.05, 0.75, 0.05)]).tolist() == \
        [Occupancy.FREE, Occupancy.UNKNOWN, Occupancy.FREE]


def test_in_its_end_margin_a_beam_frees_unknown_voxels_only():
    occupied = {}
    for end_margin in (0, 0.5):
        mapper = cuboid_map.Mapper(resolution=0.1, end_margin=end_margin)
        for end in (0.85, 1.05, 1.05, 1.05):
            mapper.integrate([(end, 0.05, 0.05)], origin=(0.05, 0.05, 0.05))
        occupied[end_margin] = mapper.classify([(0.85, 0.05, 0.05), (0.95, 0.05, 0.05)]).tolist()
    assert occupied == {0: [Occupancy.FREE, Occupancy.FREE], 0.5: [Occupancy.OCCUPIED, Occupancy.FREE]}
    with pytest.raises(ValueError, match='end_margin is -1, but must be at least 0'):
        cuboid_map.Mapper(end_margin=-1)


def test_beams_without_return_are_found_in_an_organized_cloud():
    azimuth, elevation = np.meshgrid(np.linspace(0, 6, 120), np.linspace(-0.3, 0.3, 16))
    directions = np.stack([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation),
                           np.sin(elevation)], axis=2)
    cloud = 4 * directions
    lost = np.random.default_rng(1).random(cloud.shape[:2]) < 0.1
    cloud[lost] = np.nan
    found = cuboid_map.find_no_return_beams(cloud)
    assert lost.sum() > 100
    np.testing.assert_allclose(found, directions[lost], atol=0.01)
    assert len(cuboid_map.find_no_return_beams(np.random.default_rng(1).normal(size=(16, 120, 3)))) == 0
    with pytest.raises(ValueError, match='rows, columns, 3'):
        cuboid_map.find_no_return_beams(cloud.reshape(-1, 3))


@pytest.mark.parametrize('arguments, text', [
    (dict(points=np.zeros((3, 4))), r'points must have the shape \(n, 3\); it has \(3, 4\)'),
    (dict(points=np.zeros(3)), r'points must have the shape'),
    (dict(points=[], no_returns=np.zeros((1, 2))), r'no_returns must have the shape'),
    (dict(points=[], pose=np.eye(3)), r'pose must have the shape \(4, 4\); it has \(3, 3\)'),
    (dict(points=[], pose=2 * np.eye(4)), 'pose must be a rigid transform'),
    (dict(points=[], pose=np.diag([1, 1, -1, 1])), 'pose must be a rigid transform'),
    (dict(points=[], pose=np.full((4, 4), np.nan)), 'pose must be a rigid transform'),
    (dict(points=[], origin=(0, 0)), r'origin must have the shape \(3,\)'),
    (dict(points=[], origin=(0, np.inf, 0)), 'origin must be finite'),
    (dict(points=np.ma.array([[1.0, 1.0, 1.0]], mask=[[True] * 3])), 'masked array'),
    (dict(points=[np.ma.array([1.0, 1.0, 1.0], mask=True)]), 'masked array'),
    (dict(points=np.array([['1', '1', '1']])), 'the dtype <U1: its values must be real numbers'),
    (dict(points=[['1', '1', '1']]), 'must be real numbers'),
    (dict(points=np.ones((1, 3), complex)), 'complex128'),
    (dict(points=np.array([[1.0, None, 1.0]])), 'object'),
    (dict(points=np.zeros((1, 3), 'datetime64[s]')), 'datetime64'),
    (dict(points=[], pose=np.ma.array(np.eye(4), mask=np.eye(4))), 'masked array'),
    (dict(points=[], origin=('1', '2', '3')), 'must be real numbers'),
])
def test_what_is_no_scan_is_refused(arguments, text):
    with pytest.raises(ValueError, match=text):
        cuboid_map.Mapper().integrate(**arguments)


def test_everything_that_is_wrong_with_a_configuration_is_said_at_once():
    wrong = dict(resolution=-1, max_range='far', hit=0.2, environment='nice', fusion=3, threads=1.5, min_branches=0,
                 max_branches=1000, growth_settle_clouds=10**30, resolutoin=0.1)
    with pytest.raises(ValueError) as error:
        cuboid_map.Mapper(**wrong)
    lines = str(error.value).split('\n')
    assert len(lines) == 1 + len(wrong)
    for key in wrong:
        assert any(line.strip().startswith(key + ' is ') for line in lines), key
    assert "resolution is -1, but must be 0.001 to 100" in str(error.value)
    with pytest.raises(ValueError, match="resolution is '0.1', but must be a number"):
        cuboid_map.Mapper(resolution='0.1')
    with pytest.raises(ValueError, match='half of max_branches'):
        cuboid_map.Mapper(max_branches=4, min_branches=3)


def test_truth_values_of_numpy_are_truth_values():
    cuboid_map.Mapper(keep_surfaces=np.bool_(True))
    with pytest.raises(ValueError, match='keep_surfaces is 1, but must be True or False'):
        cuboid_map.Mapper(keep_surfaces=1)


@pytest.mark.parametrize('config', [
    dict(fusion='none'), dict(fusion='growth', growth_settle_clouds=2),
    dict(threads=2), dict(threads=0), dict(max_branches=4, min_branches=2)])
def test_voxels_do_not_depend_on_fusion_tree_and_threads(config):
    expected = map_of_room()
    mapper = map_of_room(**config)
    assert voxels_of(mapper.cuboids()) == voxels_of(expected.cuboids())
    cells = np.argwhere(expected.dense(ROOM)) * 0.1 + ROOM[:3]
    np.testing.assert_array_equal(mapper.log_odds(cells), expected.log_odds(cells))


def test_a_static_environment_keeps_what_is_stable():
    free = {}
    for environment in ('static', 'dynamic'):
        mapper = cuboid_map.Mapper(resolution=0.1, environment=environment)
        for end in [(1.05, 0.05, 0.05)] * 20 + [(2.05, 0.05, 0.05)] * 20:
            mapper.integrate([end], origin=(0.05, 0.05, 0.05))
        free[environment] = mapper.classify([(1.05, 0.05, 0.05)])[0] == Occupancy.FREE
    assert free == {'static': False, 'dynamic': True}


def test_boxes_are_set_and_everything_is_cleared():
    mapper = cuboid_map.Mapper(resolution=0.1)
    mapper.set_boxes([(0, 0, 0, 1, 1, 1)], 'free')
    mapper.set_boxes([(0, 0, 0, 0.5, 1, 1), (0.8, 0, 0, 1, 1, 1)], Occupancy.OCCUPIED)
    mapper.set_boxes([(0, 0, 0, 0.1, 1, 1)], cuboid_map.Occupancy.UNKNOWN)
    counts = np.bincount(mapper.dense((0, 0, 0, 1, 1, 1)).ravel())
    assert counts.tolist() == [100, 300, 600]
    for wrong in ('blocked', 7, None):
        with pytest.raises(ValueError, match='occupancy is'):
            mapper.set_boxes([(0, 0, 0, 1, 1, 1)], wrong)
    with pytest.raises(ValueError, match='1e9'):
        mapper.set_boxes([(0, 0, 0, 1000, 1000, 1000)], 'free')
    mapper.set_boxes([(-1000, -1000, -1000, 1000, 1000, 1000)], 'unknown')
    assert mapper.num_cuboids == 0
    mapper.set_boxes([(0, 0, 0, 1, 1, 1)], 'free')
    mapper.clear()
    assert mapper.num_cuboids == 0


def longest_pause(call):
    """The longest time that another thread has to wait for the GIL, as a part of the call's time."""
    is_over = threading.Event()
    steps = []

    def count():
        while not is_over.is_set():
            steps.append(time.perf_counter())
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.perf_counter()
    call()
    end = time.perf_counter()
    is_over.set()
    thread.join()
    times = [begin, *(step for step in steps if begin < step < end), end]
    return np.diff(times).max() / (end - begin)


def test_other_threads_run_while_a_scan_is_integrated_and_distances_are_found():
    mapper = cuboid_map.Mapper(resolution=0.02)
    points = scan_room(POSES[0], num_beams=200000)
    # A busy machine may not run the other thread during a call.
    assert any(longest_pause(lambda: mapper.integrate(points, POSES[0])) < 0.6 for _ in range(100))
    coarse = map_of_room()
    many = np.tile(points, (5, 1)).astype(float)
    assert any(longest_pause(lambda: coarse.distances(many, 0.2)) < 0.6 for _ in range(20))


def test_questions_are_asked_beside_changes():
    mapper = cuboid_map.Mapper(resolution=0.1, threads=2)
    failures = []

    def ask():
        try:
            for _ in range(200):
                whole = mapper.cuboids()
                voxels = (whole.cells[:, 3:] - whole.cells[:, :3]).prod(axis=1).sum()
                assert voxels in totals or voxels == 0, voxels
        except BaseException as error:  # pylint: disable=broad-except
            failures.append(error)

    # Each step adds a box: a question in between must see whole steps only.
    totals = {1000 * step for step in range(1, 21)}
    threads = [threading.Thread(target=ask) for _ in range(3)]
    for thread in threads:
        thread.start()
    for step in range(20):
        mapper.set_boxes([(step, 0, 0, step + 1, 1, 1)], 'free')
        mapper.integrate(np.empty((0, 3)))
    for thread in threads:
        thread.join()
    assert not failures, failures[0]
