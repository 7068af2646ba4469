# SPDX-License-Identifier: BSD-3-Clause
"""cuboid_map: joined cuboids, boxes to a budget, and frontiers."""
import cuboid_map
import numpy as np
import pytest
from cuboid_map import Occupancy
from scenes import pose_at, scan_room


@pytest.fixture(name='room', scope='module')
def make_room():
    mapper = cuboid_map.Mapper(resolution=0.1)
    pose = pose_at((0.01, 0.02, 0.03))
    mapper.integrate(scan_room(pose, num_beams=20000), pose)
    return mapper


def voxels_of(boxes):
    voxels = set()
    for box in np.round(np.asarray(boxes) / 0.1).astype(int):
        axes = [range(box[axis], box[axis + 3]) for axis in range(3)]
        voxels |= {(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]}
    return voxels


def test_joined_cuboids_are_fewer_and_hold_the_same_voxels(room):
    tiles = room.cuboids(classes='occupied')
    joined = room.cuboids(classes='occupied', joined=True)
    assert len(joined.boxes) < len(tiles.boxes)
    assert voxels_of(joined.boxes) == voxels_of(tiles.boxes)
    part = room.cuboids((-1, -1, 0, 1, 1, 1), joined=True)
    assert part.boxes.min() >= -1 - 1e-9 and part.boxes.max() <= 1 + 1e-9
    assert set(part.occupancy) <= {Occupancy.FREE, Occupancy.OCCUPIED}


def test_few_boxes_cover_the_walls(room):
    occupied = voxels_of(room.cuboids(classes='occupied').boxes)
    cover = room.cover_occupied(20)
    covered = voxels_of(cover.boxes)
    assert len(cover.boxes) <= 20 and occupied <= covered
    assert cover.added_volume == pytest.approx(1e-3 * len(covered - occupied))
    assert cover.occupied_volume == pytest.approx(1e-3 * len(occupied))
    robot = (-0.3, -0.3, -0.3, 0.3, 0.3, 0.3)
    kept = room.cover_occupied(20, keep_free=[robot])
    assert not voxels_of(kept.boxes) & voxels_of([robot])
    with pytest.raises(ValueError, match='max_boxes is 1: because of keep_free .* [0-9]+ are needed'):
        room.cover_occupied(1, keep_free=[robot])
    for wrong in (0, -4):
        with pytest.raises(ValueError, match='must be > 0'):
            room.cover_occupied(wrong)
    for wrong in ((0, 0, 0, np.inf, 1, 1), (0, 0, 0, 1, 1, np.nan), (0, 0, 0, 0, 0, 0)):
        with pytest.raises(ValueError, match='region'):
            room.cover_occupied(5, wrong)
        with pytest.raises(ValueError, match='keep_free'):
            room.cover_occupied(5, keep_free=[wrong])
    assert len(room.cover_occupied(20, keep_passages=(0.3, 0.3, 0.2)).boxes) <= 20
    for wrong in (-1, (0.5, 0.5), (0.5, np.nan, 0.5), (0.5, 0, 0.5)):
        with pytest.raises(ValueError, match='keep_passages'):
            room.cover_occupied(5, keep_passages=wrong)


@pytest.mark.parametrize('overlap', [False, True])
def test_free_boxes_are_free(room, overlap):
    free = voxels_of(room.cuboids(classes='free').boxes)
    found = room.free_boxes(12, overlap=overlap)
    covered = voxels_of(found.boxes)
    assert 0 < len(found.boxes) <= 12 and covered <= free
    assert found.covered_volume == pytest.approx(1e-3 * len(covered))
    assert found.missing_volume == pytest.approx(1e-3 * len(free - covered))
    with pytest.raises(ValueError, match='max_boxes is 0'):
        room.free_boxes(0)


def test_frontiers_lie_beside_unknown_space(room):
    found = room.find_frontiers((0.3, 0.3, 0.3), view_range=0.5)
    assert len(found.center) == len(found.place) == len(found.unknown_volume) == len(found.end) > 0
    assert found.end[-1] == len(found.voxels)
    sizes = np.diff(found.end, prepend=0)
    assert (np.diff(sizes) <= 0).all() and sizes[0] > 1
    assert (room.classify(found.voxels) == Occupancy.FREE).all()
    steps = 0.1 * np.concatenate([np.eye(3), -np.eye(3)])
    around = room.classify((found.voxels[:, None] + steps).reshape(-1, 3)).reshape(-1, 6)
    assert (around == Occupancy.UNKNOWN).any(axis=1).all()
    stands = np.isfinite(found.place).all(axis=1)
    assert (found.unknown_volume[~stands] == 0).all()
    assert len(room.find_frontiers((0.3, 0.3, 0.3), min_voxels=10**6).center) == 0
    with pytest.raises(ValueError, match='edges > 0'):
        room.find_frontiers((0, 1, 1))
    for wrong in (np.inf, np.nan, -1, 51):
        with pytest.raises(ValueError, match='all finite, and view_range at most 500 voxels'):
            room.find_frontiers((1, 1, 1), view_range=wrong)


def test_distances_are_those_of_the_nearest_voxel(room):
    occupied = np.array(sorted(voxels_of(room.cuboids(classes='occupied').boxes)))
    points = np.random.default_rng(4).uniform(-1.5, 1.5, size=(200, 3))
    found = room.distances(points, bound=1.0)
    away = np.floor(points / 0.1)[:, None] - occupied[None]
    least = 0.1 * np.sqrt((away ** 2).sum(axis=2).min(axis=1))
    np.testing.assert_allclose(found.distance, np.where(least <= 1.0 + 1e-9, least, np.inf))
    norms = np.linalg.norm(found.gradient, axis=1)
    np.testing.assert_allclose(norms, np.isfinite(found.distance) & (found.distance > 0))
    assert room.distances(np.empty((0, 3)), 1.0).distance.shape == (0,)
    for wrong in (0, -1, np.nan, np.inf, 13):
        with pytest.raises(ValueError, match=r'at most 127 voxels, here 12\.7\d* m, not .* m'):
            room.distances(points, wrong)
    with pytest.raises(ValueError, match='points must be finite'):
        room.distances([(0, 0, np.nan)], 1.0)
    with pytest.raises(ValueError, match='at most 1e9 voxels'):
        room.distances([(0, 0, 0), (1e6, 1e6, 1e6)], 1.0)
