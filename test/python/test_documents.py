# SPDX-License-Identifier: BSD-3-Clause
"""Runs the programs of doc/python.md and examples/."""
import os
import pathlib
import re
import struct
import subprocess
import sys
import zlib

import cuboid_map
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_the_code_of_the_guide_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r'^```python\n(.*?)^```', (ROOT / 'doc/python.md').read_text(), re.MULTILINE | re.DOTALL)
    assert len(blocks) > 3
    scope = {}
    for block in blocks:
        exec(block, scope)  # pylint: disable=exec-used
    said = capsys.readouterr().out
    assert "['FREE', 'OCCUPIED']" in said
    assert 'colour is not known' in said and 'fusion is' in said and 'resolution is -1' in said
    assert scope['paths'].free.tolist() == [True, False]
    assert np.isfinite(scope['place']).all() and np.isfinite(scope['near'].distance).all()
    points = [(1, 0, 0.5), (4.05, 0.05, 0.55), (9, 9, 9)]
    assert scope['again'].classify(points).tolist() == scope['mapper'].classify(points).tolist() == [1, 2, 0]
    assert (tmp_path / 'hall.bt').stat().st_size > 100


def read_png(file):
    content = file.read_bytes()
    width, height = struct.unpack('>II', content[16:24])
    begin = content.index(b'IDAT')
    (size,) = struct.unpack('>I', content[begin - 4:begin])
    rows = np.frombuffer(zlib.decompress(content[begin + 4:begin + 4 + size]), np.uint8).reshape(height, -1)
    return rows[:, 1:].reshape(height, width, 3)


def run_example(*arguments, **environment):
    command = [sys.executable, str(ROOT / 'examples/scans_to_picture.py'), *map(str, arguments)]
    return subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, check=False)


@pytest.fixture(name='drive', scope='module')
def make_drive(tmp_path_factory):
    end = run_example(TMPDIR=str(tmp_path_factory.mktemp('drive')))
    assert end.returncode == 0, end.stderr
    return pathlib.Path(re.search(r'^(.*)/map.png: ', end.stdout, re.MULTILINE)[1])


def test_the_example_goes_from_scans_to_a_picture(drive):
    image = read_png(drive / 'map.png')[::4, ::4][::-1]  # One pixel per voxel, y upwards.
    assert image.shape[0] in (60, 61, 62) and image.shape[1] in (100, 101, 102)
    is_wall = (image[:, :, 2] != image[:, :, 0]) & (image[:, :, 1] == 60)
    is_free = (image == 255).all(axis=2)
    assert is_wall[5:20, 49:51].any(axis=1).all(), 'between the rooms'
    assert is_free[28:32, 20:80].all(), 'the door, and the way through it'
    assert not is_free[11:14, 71:74].any(), 'inside a pillar'
    assert cuboid_map.Mapper.load(str(drive / 'map.cuboids')).num_cuboids > 1000


def test_the_example_reads_a_folder_and_refuses_what_it_cannot_read(drive, tmp_path):
    assert len(list((drive / 'scans').iterdir())) == 9
    end = run_example(drive, tmp_path / 'again.png')
    assert end.returncode == 0, end.stderr
    np.testing.assert_array_equal(read_png(tmp_path / 'again.png'), read_png(drive / 'map.png'))
    (tmp_path / 'scans').mkdir()
    (tmp_path / 'scans/0000.pcd').write_text('a scan whose pose is missing')
    end = run_example(tmp_path, tmp_path / 'none.png')
    assert end.returncode != 0 and 'poses.txt' in end.stderr
    assert (tmp_path / 'scans/0000.pcd').read_text() == 'a scan whose pose is missing'
    (tmp_path / 'poses.txt').write_text('0 0 0 0 0 0 0 1\n')
    (tmp_path / 'scans/0000.pcd').write_text('FIELDS x y z\nDATA ascii\n')
    end = run_example(tmp_path, tmp_path / 'none.png')
    assert end.returncode != 0
    assert 'only binary files' in end.stderr
