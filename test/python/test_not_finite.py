# SPDX-License-Identifier: BSD-3-Clause
"""Each function of a map is given NaN and infinity, in each argument."""
import inspect

import cuboid_map
import numpy as np
import pytest
from scenes import pose_at

POINT, BOX, SIZE = (1, 0.5, 0.5), (0, 0, 0, 4, 2, 1), (0.3, 0.3, 0.3)
START, GOAL = pose_at((1, 1, 0.5)), pose_at((1.5, 1, 0.5))
BODY = dict(spheres=[(0, 0, 0, 0.1)], boxes=[SIZE], box_poses=[np.eye(4)])
WAY = dict(time_limit=9.0, region=BOX, clearance=0.0, start_tolerance=0.0, goal_tolerance=0.0)
GOOD = {
    'cast_rays': dict(origins=[POINT], directions=[(1, 0, 0)], max_range=1.0),
    'check_motion': dict(poses=[START, GOAL], **BODY),
    'check_paths': dict(paths=[[POINT, POINT]], size=SIZE),
    'check_poses': dict(poses=[START], **BODY),
    'classify': dict(points=[POINT]),
    'cover_occupied': dict(region=BOX, keep_free=[(0, 0, 0, 1, 1, 1)], keep_passages=0.5, previous=[BOX], max_boxes=5),
    'cuboids': dict(box=BOX),
    'dense': dict(box=BOX),
    'distances': dict(points=[POINT], bound=1.0),
    'find_corridor': dict(start=POINT, goal=POINT, size=SIZE, inflation=0.0, **WAY),
    'find_frontiers': dict(size=SIZE, region=BOX, max_distance=1.0, view_range=1.0),
    'find_path': dict(start=START, goal=GOAL, **BODY, **WAY),
    'free_boxes': dict(region=BOX, max_boxes=5),
    'integrate': dict(points=[POINT], pose=START, origin=POINT, no_returns=[POINT]),
    'log_odds': dict(points=[POINT]),
    'nearest': dict(points=[POINT], max_distance=1.0),
    'nearest_free': dict(points=[POINT], size=SIZE, max_distance=1.0),
    'query_boxes': dict(boxes=[BOX]),
    'set_boxes': dict(boxes=[BOX], occupancy='free'),
}
# What the reference says of points that are not finite, and of distances and times without a limit.
MAY_BE_ANYTHING = [('classify', 'points'), ('log_odds', 'points'), ('integrate', 'points'), ('integrate', 'no_returns')]
MAY_BE_INFINITE = ['time_limit', 'start_tolerance', 'goal_tolerance']


def make_room():
    mapper = cuboid_map.Mapper(resolution=0.1)
    mapper.set_boxes([BOX], 'free')
    mapper.set_boxes([(2, 0, 0, 2.1, 1.2, 1)], 'occupied')
    return mapper


def is_answered(function, argument, value):
    is_limit = argument in MAY_BE_INFINITE or (function, argument) == ('nearest', 'max_distance')
    return (function, argument) in MAY_BE_ANYTHING or (is_limit and value == np.inf)


def test_all_functions_are_asked():
    functions = {name for name, value in inspect.getmembers(cuboid_map.Mapper, callable) if name[0] != '_'}
    assert functions - set(GOOD) == {'clear', 'load', 'save'}


@pytest.mark.parametrize('function', GOOD)
@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf])
def test_arguments_that_are_not_finite_are_refused_or_answered_as_the_reference_says(function, value):
    good = GOOD[function]
    getattr(make_room(), function)(**good)
    for argument in good:
        if isinstance(good[argument], (str, int)):
            continue
        for index in range(np.size(good[argument])):
            wrong = np.array(good[argument], float)
            wrong.flat[index] = value
            call = {**good, argument: wrong if wrong.ndim else float(wrong)}
            if is_answered(function, argument, value):
                getattr(make_room(), function)(**call)
                continue
            with pytest.raises(ValueError) as error:
                getattr(make_room(), function)(**call)
            assert argument.split('_')[-1].rstrip('s') in str(error.value), (argument, index)
