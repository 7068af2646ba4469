# SPDX-License-Identifier: BSD-3-Clause
"""cuboid_map: files of maps."""
import os

import cuboid_map
import numpy as np
import pytest
from scenes import ROOM, pose_at, scan_room

BOX = tuple(np.round(ROOM, 1))


@pytest.fixture(name='mapper')
def make_mapper():
    mapper = cuboid_map.Mapper(resolution=0.1, hit=0.8)
    pose = pose_at((0.01, 0.02, 0.03))
    mapper.integrate(scan_room(pose), pose)
    mapper.frame_id = 'hall'
    return mapper


def centres():
    axes = (np.arange(BOX[axis], BOX[axis + 3], 0.1) + 0.05 for axis in range(3))
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)


def test_a_saved_map_is_loaded_as_it_was(mapper, tmp_path):
    file = str(tmp_path / 'map.cuboids')
    assert mapper.save(file) == (tmp_path / 'map.cuboids').stat().st_size
    loaded = cuboid_map.Mapper.load(file, max_range=5, threads=2)
    assert isinstance(loaded, cuboid_map.Mapper)
    assert (loaded.resolution, loaded.frame_id) == (0.1, 'hall')
    assert np.isfinite(mapper.log_odds(centres())).sum() > 1000
    np.testing.assert_array_equal(loaded.log_odds(centres()), mapper.log_odds(centres()))
    for each in (mapper, loaded):
        each.integrate([(0.9, 0.0, 0.0)], pose_at((0.01, 0.02, 0.03)))
    np.testing.assert_array_equal(loaded.log_odds(centres()), mapper.log_odds(centres()), 'the sensor model, too')


def test_an_argument_counts_more_than_the_file(mapper, tmp_path):
    file = str(tmp_path / 'map.cuboids')
    mapper.save(file)
    loaded = cuboid_map.Mapper.load(file, hit=0.6)
    point = [(10.0, 0.0, 0.0)]
    loaded.integrate(point)
    np.testing.assert_allclose(loaded.log_odds(point), np.log(0.6 / 0.4), atol=1e-5)
    with pytest.raises(ValueError, match='resolution'):
        cuboid_map.Mapper.load(file, resolution=0.2)
    with pytest.raises(ValueError, match='fusion is 7'):
        cuboid_map.Mapper.load(file, fusion=7)


def test_maps_are_converted_to_octomaps_formats_and_back(mapper, tmp_path):
    names = {end: str(tmp_path / ('map.' + end)) for end in ('cuboids', 'ot', 'bt', 'pcd', 'ply', 'csv')}
    mapper.save(names['cuboids'])
    for end in ('ot', 'bt', 'pcd', 'ply', 'csv'):
        assert cuboid_map.convert(names['cuboids'], names[end]) == (tmp_path / ('map.' + end)).stat().st_size > 100
    np.testing.assert_array_equal(cuboid_map.Mapper.load(names['ot']).log_odds(centres()), mapper.log_odds(centres()))
    np.testing.assert_array_equal(cuboid_map.Mapper.load(names['bt']).classify(centres()), mapper.classify(centres()))


def test_what_cannot_be_read_or_written_is_said(mapper, tmp_path):
    missing, damaged = str(tmp_path / 'missing.cuboids'), tmp_path / 'damaged.cuboids'
    for call in (lambda: cuboid_map.Mapper.load(missing), lambda: cuboid_map.convert(missing, str(tmp_path / 'x.bt')),
                 lambda: mapper.save(str(tmp_path / 'no_folder' / 'map.cuboids'))):
        with pytest.raises(cuboid_map.MapFileError, match=str(tmp_path)):
            call()
    mapper.save(str(damaged))
    content = bytearray(damaged.read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    with pytest.raises(OSError, match='damaged.cuboids'):
        cuboid_map.Mapper.load(str(damaged))
    for call in (lambda: mapper.save(str(tmp_path / 'map.xyz')), lambda: cuboid_map.convert(missing, 'map.xyz')):
        with pytest.raises(ValueError, match=r'must end in one of \.cuboids, \.sqlite, \.ot, \.bt'):
            call()


def test_names_of_files_are_those_that_open_takes(mapper, tmp_path):
    path = tmp_path / 'map.cuboids'
    size = mapper.save(path)
    assert cuboid_map.Mapper.load(path).num_cuboids == mapper.num_cuboids
    assert cuboid_map.convert(path, tmp_path / 'map.bt') == (tmp_path / 'map.bt').stat().st_size
    not_utf8 = os.fsdecode(bytes(tmp_path) + b'/\xff.cuboids')
    assert mapper.save(not_utf8) == size == os.stat(not_utf8).st_size
    (tmp_path / 'other').write_text('another file')
    with pytest.raises(ValueError, match='null'):
        mapper.save(str(tmp_path / 'other') + '\0.cuboids')
    assert (tmp_path / 'other').read_text() == 'another file'
    with pytest.raises(TypeError, match='not int'):
        mapper.save(3)
