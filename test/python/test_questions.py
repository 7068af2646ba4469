# SPDX-License-Identifier: BSD-3-Clause
"""cuboid_map.Map: queries of a map."""
import cuboid_map
import numpy as np
import pytest
from cuboid_map import CorridorEnd, Occupancy, RayEnd

NO_BOX = r'it must be min x, y, z, max x, y, z'


@pytest.fixture(name='room')
def make_room():
    """The room of the planner guide: free, 4 x 2 x 1 m, with a wall at x = 2 that leaves 0.8 m."""
    mapper = cuboid_map.Mapper(resolution=0.1)
    mapper.set_boxes([(0, 0, 0, 4, 2, 1)], 'free')
    mapper.set_boxes([(2, 0, 0, 2.1, 1.2, 1)], 'occupied')
    return mapper


def random_map(seed):
    """A map of random boxes, and its classes as an array of 24 x 20 x 16 voxels."""
    random = np.random.default_rng(seed)
    mapper = cuboid_map.Mapper(resolution=0.5)
    classes = np.zeros((24, 20, 16), np.uint8)
    for _ in range(40):
        low = random.integers(0, (20, 16, 12))
        high = low + random.integers(1, 6, 3)
        high = np.minimum(high, classes.shape)
        value = random.choice(list(Occupancy))
        mapper.set_boxes([np.hstack([low, high]) * 0.5], value)
        classes[tuple(slice(a, b) for a, b in zip(low, high))] = value
    return mapper, classes


WHOLE = (0, 0, 0, 12, 10, 8)


@pytest.mark.parametrize('seed', range(5))
def test_dense_points_boxes_and_cuboids_agree_voxel_by_voxel(seed):
    mapper, classes = random_map(seed)
    assert len(np.unique(classes)) == 3
    np.testing.assert_array_equal(mapper.dense(WHOLE), classes)
    cells = np.argwhere(classes >= 0)
    np.testing.assert_array_equal(mapper.classify((cells + 0.5) * 0.5), classes.ravel())
    boxes = mapper.query_boxes(np.hstack([cells, cells + 1]) * 0.5)
    np.testing.assert_array_equal(boxes.occupancy, classes.ravel())
    np.testing.assert_allclose(boxes.free_volume, 0.125 * (classes.ravel() == Occupancy.FREE))
    filled = np.zeros_like(classes)
    whole = mapper.cuboids()
    for box, occupancy in zip(whole.cells, whole.occupancy):
        part = filled[tuple(slice(a, b) for a, b in zip(box[:3], box[3:]))]
        assert not part.any()
        part[...] = occupancy
    np.testing.assert_array_equal(filled, classes)
    np.testing.assert_allclose(whole.boxes, whole.cells * 0.5)
    assert len(whole.cells) == mapper.num_cuboids
    np.testing.assert_allclose(whole.mean_probability, np.where(whole.occupancy == 2, 0.97, 0.12), atol=1e-5)


def test_boxes_have_their_volumes(room):
    found = room.query_boxes([(1, 0, 0, 3, 1, 1), (5, 5, 5, 6, 6, 6), (0, 0, 0, 1, 1, 1), (3.5, 0, 0, 4.5, 1, 1)])
    assert found.occupancy.tolist() == [Occupancy.OCCUPIED, Occupancy.UNKNOWN, Occupancy.FREE, Occupancy.UNKNOWN]
    np.testing.assert_allclose(found.free_volume, [1.9, 0, 1, 0.5])
    np.testing.assert_allclose(found.occupied_volume, [0.1, 0, 0, 0])
    np.testing.assert_allclose(found.unknown_volume, [0, 1, 0, 0.5])
    assert len(room.query_boxes([]).occupancy) == 0
    for wrong in ((0, 0, 0, 0, 1, 1), (1, 0, 0, 0, 1, 1), (0, 0, 0, np.nan, 1, 1), (0, 0, 0, 1e12, 1, 1)):
        with pytest.raises(ValueError, match=r'boxes\[1\] is .*' + NO_BOX):
            room.query_boxes([(0, 0, 0, 1, 1, 1), wrong])
    with pytest.raises(ValueError, match=r'boxes must have the shape \(n, 6\)'):
        room.query_boxes([(0, 0, 1, 1)])


def test_cuboids_are_chosen_by_box_and_class(room):
    wall = room.cuboids(classes='occupied')
    np.testing.assert_allclose(wall.boxes[:, :3].min(axis=0), (2, 0, 0))
    np.testing.assert_allclose(wall.boxes[:, 3:].max(axis=0), (2.1, 1.2, 1))
    assert (wall.cells[:, 3:] - wall.cells[:, :3]).prod(axis=1).sum() == 120
    assert set(room.cuboids(classes='free').occupancy) == {Occupancy.FREE}
    clipped = room.cuboids((1.95, 0.5, 0.2, 2.05, 0.8, 0.4), clip=True)
    assert (clipped.boxes >= (1.9, 0.5, 0.2, 1.9, 0.5, 0.2)).all()
    np.testing.assert_allclose(clipped.boxes[clipped.occupancy == Occupancy.OCCUPIED], [(2, 0.5, 0.2, 2.1, 0.8, 0.4)])
    whole = room.cuboids((1.95, 0.5, 0.2, 2.05, 0.8, 0.4))
    np.testing.assert_allclose(whole.boxes[whole.occupancy == Occupancy.OCCUPIED], [(2, 0, 0, 2.1, 0.8, 0.8)])
    with pytest.raises(ValueError, match="classes is 'none'"):
        room.cuboids(classes='none')
    with pytest.raises(ValueError, match=NO_BOX):
        room.cuboids((0, 0, 0, 0, 0, 0))


def test_rays_end_at_walls_and_at_unknown_space(room):
    rays = room.cast_rays((1, 0.5, 0.5), [(2, 0, 0), (-1, 0, 0), (0, 1, 0)], max_range=1.2)
    assert rays.end.tolist() == [RayEnd.OCCUPIED, RayEnd.UNKNOWN, RayEnd.MAX_RANGE]
    np.testing.assert_allclose(rays.distance, [1, 1, 1.2])
    np.testing.assert_allclose(rays.point, [(2, 0.5, 0.5), (0, 0.5, 0.5), (1, 1.7, 0.5)], atol=1e-9)
    np.testing.assert_allclose(rays.first_unknown, [np.inf, 1, np.inf])
    through = room.cast_rays([(1, 0.5, 0.5)], [(-1, 0, 0)], 1.2, unknown='free')
    assert through.end.tolist() == [RayEnd.MAX_RANGE]
    np.testing.assert_allclose(through.unknown_length, [0.2])
    assert room.cast_rays(np.empty((0, 3)), np.empty((0, 3)), 1).end.shape == (0,)
    with pytest.raises(ValueError, match='2 origins and 1 directions'):
        room.cast_rays([(0, 0, 0)] * 2, [(1, 0, 0)], 1)
    with pytest.raises(ValueError, match=r'directions\[1\]'):
        room.cast_rays((0, 0, 0), [(1, 0, 0), (0, 0, 0)], 1)
    with pytest.raises(ValueError, match="unknown is 'maybe'"):
        room.cast_rays((0, 0, 0), [(1, 0, 0)], 1, unknown='maybe')


def test_paths_end_where_a_robot_meets_something(room):
    paths = room.check_paths([[(0.5, 1.6, 0.5), (3.5, 1.6, 0.5), (3.5, 0.2, 0.5)],
                              [(0.5, 1.6, 0.5), (3.5, 1.6, 0.5), (3.5, 0.5, 0.5)],
                              [(0.5, 0.5, 0.5), (3.5, 0.5, 0.5), (3.5, 1.5, 0.5)]], (0.5, 0.5, 0.5))
    assert paths.free.tolist() == [False, True, False]
    assert paths.free.dtype == bool
    np.testing.assert_allclose(paths.free_length, [4.35, 4.1, 1.25])
    np.testing.assert_allclose(paths.length, [4.4, 4.1, 4.0])
    assert paths.segment.tolist() == [1, -1, 0]
    np.testing.assert_allclose(paths.point, [(3.5, 0.25, 0.5), (np.nan,) * 3, (1.75, 0.5, 0.5)], atol=1e-6)
    beyond = [[(0.5, 1.6, 0.5), (-5, 1.6, 0.5)]]
    assert not room.check_paths(beyond, (0.5, 0.5, 0.5)).free[0]
    assert room.check_paths(beyond, (0.5, 0.5, 0.5), unknown='free').free[0]
    for wrong in ([(0, 0, 0)], np.empty((1, 0, 3)), [[(0, 0)]]):
        with pytest.raises(ValueError, match=r'paths must have the shape \(m, n, 3\)'):
            room.check_paths(wrong, (1, 1, 1))
    with pytest.raises(ValueError, match='size must be'):
        room.check_paths(beyond, (1, 1, 0))
    with pytest.raises(ValueError, match=r'paths\[0\]: .* finite'):
        room.check_paths([[(0, 0, np.nan)]], (1, 1, 1))


def yawed(x, y, yaw):
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:3, 3] = x, y, 0.5
    return pose


def test_bodies_that_turn_fit_or_meet_something(room):
    along, across = yawed(2.05, 1.6, 0), yawed(2.05, 1.6, np.pi / 2)
    base = room.check_poses([along, across, across.astype(np.float32)], boxes=[(1, 0.3, 0.3)])
    assert base.free.tolist() == [True, False, False] and base.free.dtype == bool
    assert base.part.tolist() == [-1, 0, 0]
    np.testing.assert_allclose(base.point[:2], [(np.nan,) * 3, (2.05, 1.15, 0.35)])
    spheres = [(0, 0, 0, 0.3), (0.5, 0, 0, 0.3)]
    assert room.check_poses([along, across], spheres).part.tolist() == [-1, 1]
    beside = room.check_poses([along], spheres, [(0.1, 0.1, 0.1)], box_poses=[yawed(0, -0.6, 0.3)])
    assert beside.part.tolist() == [2]
    assert not room.check_poses([yawed(4, 1, 0)], boxes=[(1, 0.3, 0.3)]).free[0]
    assert room.check_poses([yawed(4, 1, 0)], boxes=[(1, 0.3, 0.3)], unknown='free').free[0]
    assert len(room.check_poses([], spheres).free) == 0
    for match, wrong in [
            ('no part', dict()), (r'spheres\[1\]: radii', dict(spheres=[(0, 0, 0, 1), (0, 0, 0, -1)])),
            (r'shape \(k, 4\)', dict(spheres=[(0, 0, 0)])), ('in metres', dict(boxes=[(1000, 1, 1)])),
            ('0 box_poses and 1 boxes', dict(boxes=[(1, 1, 1)], box_poses=[]))]:
        with pytest.raises(ValueError, match=match):
            room.check_poses([along], **wrong)
    for match, wrong in [(r'poses\[1\] must be a rigid transform', [along, 2 * along]), (r'\(n, 4, 4\)', along),
                         (r'poses\[0\]: the pose must be finite', [yawed(1e12, 0, 0)])]:
        with pytest.raises(ValueError, match=match):
            room.check_poses(wrong, spheres)


def test_a_base_moves_and_turns_around_the_wall(room):
    base = dict(boxes=[(1, 0.6, 0.3)])
    start, goal = yawed(0.8, 0.7, np.pi / 2), yawed(3.2, 0.7, np.pi / 2)
    path = room.find_path(start, goal, **base)
    assert path.end == CorridorEnd.FOUND and path.num_poses > 0
    np.testing.assert_allclose(path.poses[[0, -1]], [start, goal], atol=1e-12)
    motion = room.check_motion(path.poses, **base)
    assert motion.free and motion.segment == motion.part == -1 and np.isnan(motion.point).all()
    np.testing.assert_allclose([motion.length, motion.free_length], path.length)
    np.testing.assert_allclose(motion.pose, goal, atol=1e-12)
    into = room.check_motion([start, start, yawed(3.2, 0.7, np.pi / 2)], **base)
    assert not into.free and into.segment == 1 and into.part == 0
    np.testing.assert_allclose([into.free_length, into.length, into.pose[0, 3]], [0.9, 2.4, 1.7], atol=0.01)
    np.testing.assert_allclose(into.point[0], 2.05)
    spheres = [(0, 0, 0, 0.45)]
    assert room.find_path(start, goal, spheres).end == CorridorEnd.NO_WAY
    assert room.find_path(start, yawed(6, 0.7, 0), unknown='free', **base).end == CorridorEnd.FOUND
    assert room.find_path(start, goal, region=(0, 0, 0, 4, 1.5, 1), **base).end == CorridorEnd.NO_WAY
    assert room.find_path(start, yawed(2, 0.5, 0), **base).end == CorridorEnd.GOAL_BLOCKED
    assert len(room.find_path(yawed(2, 0.5, 0), goal, **base).poses) == 0
    near = room.find_path(start, yawed(2, 0.5, 0), clearance=0.1, goal_tolerance=1, **base)
    assert near.end == CorridorEnd.FOUND and 0 < near.goal_distance <= 1
    out = room.find_path(yawed(1.55, 0.5, 0), goal, start_tolerance=0.3, **base)
    assert out.end == CorridorEnd.FOUND and 0 < out.start_distance <= 0.3 and 2 < out.point[0] < 2.1
    higher = yawed(3.2, 0.7, 0)
    higher[2, 3] = 0.7
    assert room.find_path(start, higher, climb=True, **base).end == CorridorEnd.FOUND
    tilted = goal @ np.array([[1, 0, 0, 0], [0, 0.8, -0.6, 0], [0, 0.6, 0.8, 0], [0, 0, 0, 1]])
    for match, wrong in [('let the robot climb', higher), ('goal tilts', tilted), ('goal must be a rigid', 2 * goal)]:
        with pytest.raises(ValueError, match=match):
            room.find_path(start, wrong, **base)
    with pytest.raises(ValueError, match='half a turn'):
        room.check_motion([start, yawed(0.8, 0.7, -np.pi / 2)], **base)
    with pytest.raises(ValueError, match='no poses'):
        room.check_motion([], **base)


def test_the_nearest_cuboids_and_places_are_found(room):
    num_parts = len(room.cuboids(classes='occupied').boxes)
    near = room.nearest([(1, 0.5, 0.5), (3, 1.7, 0.5)], k=num_parts + 1)
    assert near.distance.shape == (2, num_parts + 1) and near.boxes.shape == (2, num_parts + 1, 6)
    np.testing.assert_allclose(near.distance[:, 0], [1, np.hypot(0.9, 0.5)])
    assert (np.diff(near.distance[:, :-1]) >= 0).all()
    assert np.isinf(near.distance[:, -1]).all() and np.isnan(near.boxes[:, -1]).all()
    np.testing.assert_allclose(near.point[:, 0], [(2, 0.5, 0.5), (2.1, 1.2, 0.5)])
    np.testing.assert_allclose(near.boxes[0, 0], (2, 0, 0, 2.1, 0.8, 0.8))
    assert near.occupancy.tolist() == [[Occupancy.OCCUPIED] * num_parts + [Occupancy.UNKNOWN]] * 2
    assert np.isinf(room.nearest([(1, 0.5, 0.5)], max_distance=0.9).distance).all()
    places = room.nearest_free([(2, 0.5, 0.5), (1, 1, 0.5), (20, 0, 0)], (0.5, 0.5, 0.5), 2)
    np.testing.assert_allclose(places, [(1.75, 0.5, 0.5), (1, 1, 0.5), (np.nan,) * 3])
    for wrong in (dict(k=0), dict(k=2**63), dict(max_distance=-1), dict(classes='any')):
        with pytest.raises(ValueError):
            room.nearest([(0, 0, 0)] * 2, **wrong)
    with pytest.raises(ValueError, match='max_distance'):
        room.nearest_free([(0, 0, 0)], (1, 1, 1), np.inf)


def test_a_corridor_leads_around_the_wall(room):
    start, goal, size = (0.5, 0.5, 0.5), (3.5, 0.5, 0.5), (0.5, 0.5, 0.5)
    corridor = room.find_corridor(start, goal, size)
    assert corridor.end == CorridorEnd.FOUND
    assert len(corridor.boxes) == len(corridor.portals) + 1 > 1
    np.testing.assert_allclose(corridor.path[[0, -1]], [start, goal])
    np.testing.assert_allclose(np.linalg.norm(np.diff(corridor.path, axis=0), axis=1).sum(), corridor.length)
    assert room.check_paths([corridor.path], size).free[0]
    assert (room.query_boxes(corridor.boxes).occupancy == Occupancy.FREE).all()
    assert room.find_corridor(start, goal, (0.5, 0.9, 0.5)).end == CorridorEnd.NO_WAY
    assert room.find_corridor((2, 0.5, 0.5), goal, size).end == CorridorEnd.START_BLOCKED
    assert room.find_corridor(start, (9, 9, 9), size).end == CorridorEnd.GOAL_BLOCKED
    assert room.find_corridor(start, (9, 0.5, 0.5), size, unknown='free').end == CorridorEnd.FOUND
    assert room.find_corridor(start, goal, size, region=(0, 0, 0, 4, 1.2, 1)).end == CorridorEnd.NO_WAY
    assert len(room.find_corridor(start, (9, 9, 9), size).path) == 0
    with pytest.raises(ValueError, match='start, goal and size must be finite'):
        room.find_corridor(start, (np.nan, 0, 0), size)
    touching = room.find_corridor((1.8, 0.5, 0.5), goal, size, start_tolerance=0.1)
    assert touching.end == CorridorEnd.FOUND
    np.testing.assert_allclose([touching.start_distance, *touching.path[1]], [0.05, 1.75, 0.5, 0.5])
    np.testing.assert_allclose(touching.point[0], 2.05)
    near = room.find_corridor(start, (9, 0.5, 0.5), size, goal_tolerance=np.inf)
    assert near.end == CorridorEnd.FOUND
    np.testing.assert_allclose([near.goal_distance, *near.path[-1]], [5.25, 3.75, 0.5, 0.5])
    assert np.isnan(corridor.point).all() and corridor.start_distance == corridor.goal_distance == 0


def test_arrays_outlive_the_map(room):
    cuboids = room.cuboids()
    expected = [column.copy() for column in cuboids]
    room.clear()
    del room
    for column, copy in zip(cuboids, expected):
        np.testing.assert_array_equal(column, copy)
        assert column.flags.writeable


def test_a_map_too_big_for_one_array_is_refused(room):
    with pytest.raises(ValueError, match='4e9|voxels'):
        room.dense((0, 0, 0, 1e4, 1e4, 1e4))


def test_a_map_says_what_it_is(room):
    assert room.resolution == 0.1
    assert 1000 < room.num_bytes < 1e7
    assert isinstance(room, cuboid_map.Map)
    with pytest.raises(TypeError):
        cuboid_map.Map()
