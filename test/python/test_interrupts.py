# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C ends long queries."""
import os
import signal
import threading
import time

import cuboid_map
import numpy as np
import pytest

LIMIT_S = 30.0


class Interrupted(Exception):
    pass


@pytest.fixture(name='interrupt')
def make_interrupt():
    """Sends SIGINT to this process in a moment, whose handler raises Interrupted."""
    def handle(*_):
        raise Interrupted

    before = signal.signal(signal.SIGINT, handle)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    yield timer.start
    timer.cancel()
    signal.signal(signal.SIGINT, before)


def closed_box():
    """A map with a goal to which no way leads, in a large space that is free."""
    mapper = cuboid_map.Mapper(resolution=0.05)
    mapper.set_boxes([(-1, -1, -1, 1, 1, 1)], 'occupied')
    mapper.set_boxes([(-0.5, -0.5, -0.5, 0.5, 0.5, 0.5)], 'free')
    return mapper


def test_a_search_for_a_corridor_ends(interrupt):
    mapper = closed_box()
    interrupt()
    begin = time.monotonic()
    with pytest.raises(Interrupted):
        mapper.find_corridor((30, 0, 0), (0, 0, 0), (0.3, 0.3, 0.3), unknown='free', time_limit=LIMIT_S,
                             region=(-500, -500, -500, 500, 500, 500))
    assert time.monotonic() - begin < LIMIT_S  # Without a look at signals, the handler runs after the search.
    assert mapper.classify([(0, 0, 0)]).tolist() == [1]  # The map is not locked any more.


def test_a_robot_that_is_too_large_is_refused():
    with pytest.raises(ValueError, match=r'points\[0\]: size has too many voxels'):
        closed_box().nearest_free([(0, 0, 0)], np.full(3, 60.0), 1.0, unknown='free')
