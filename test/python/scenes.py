# SPDX-License-Identifier: BSD-3-Clause
"""Test data of the Python module: scans of a room, and the rule of the map, voxel by voxel."""
import math

import numpy as np

# Faces of the room, metres: min x, y, z, max x, y, z.
ROOM = np.array([-2.05, -1.55, -0.55, 2.05, 1.55, 1.55])


def pose_at(position, yaw=0.0):
    """Transform to the map from a sensor at a position, rotated about z."""
    pose = np.eye(4)
    pose[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    pose[:3, 3] = position
    return pose


def scan_room(pose, num_beams=400, seed=1):
    """Points that a sensor in the room sees in random directions: (n, 3) float32, in its frame."""
    directions = np.random.default_rng(seed).normal(size=(num_beams, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    walls = np.where(directions @ pose[:3, :3].T > 0, ROOM[3:], ROOM[:3])
    with np.errstate(divide='ignore'):
        ranges = np.min((walls - pose[:3, 3]) / (directions @ pose[:3, :3].T), axis=1)
    return (directions * ranges[:, None]).astype(np.float32)


def cells_of(points, resolution):
    return np.floor(np.asarray(points, float) / resolution).astype(int)
