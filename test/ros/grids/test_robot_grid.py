#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The grid that follows a robot, as costmap_2d's static layer uses it.

costmap_2d itself is not in Debian: its rules are repeated here (static_layer.cpp, incomingMap and
incomingUpdate, with subscribe_to_updates, track_unknown_space and trinary_costmap).
"""
import threading
import time
import unittest

import rospy
from cuboid_mapping.msg import Box
from cuboid_mapping.srv import SetBox, SetBoxRequest
from geometry_msgs.msg import Point, TransformStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid
from tf2_msgs.msg import TFMessage

LETHAL, FREE, NO_INFORMATION = 254, 0, 255
PATIENCE_S = 20.0


class StaticLayer:
    """Model of costmap_2d::StaticLayer with a grid and its updates."""

    def __init__(self):
        self.lock = threading.Lock()
        self.grid = None
        self.costs = []
        self.num_grids = self.num_updates = 0
        self.subscribers = [rospy.Subscriber('robot_grid', OccupancyGrid, self.take_grid),
                            rospy.Subscriber('robot_grid_updates', OccupancyGridUpdate, self.take_update)]

    @staticmethod
    def cost(value):
        if value == -1:
            return NO_INFORMATION
        return LETHAL if value >= 100 else FREE

    def take_grid(self, grid):
        with self.lock:
            self.grid = grid.info
            self.frame = grid.header.frame_id
            self.costs = [self.cost(value) for value in grid.data]
            self.num_grids += 1

    def take_update(self, update):
        with self.lock:
            if self.grid is None or update.header.frame_id != self.frame:
                return
            values = iter(update.data)
            for y in range(update.y, update.y + update.height):
                for x in range(update.x, update.x + update.width):
                    self.costs[y * self.grid.width + x] = self.cost(next(values))
            self.num_updates += 1

    def at(self, x, y):
        """Cost at a point of the map; None outside."""
        with self.lock:
            if self.grid is None:
                return None
            column = int((x - self.grid.origin.position.x) / self.grid.resolution)
            row = int((y - self.grid.origin.position.y) / self.grid.resolution)
            inside = 0 <= column < self.grid.width and 0 <= row < self.grid.height
            return self.costs[row * self.grid.width + column] if inside else None


class TestRobotGrid(unittest.TestCase):
    def setUp(self):
        self.position = [0.0, 0.0, 0.0]
        publisher = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self.timer = rospy.Timer(rospy.Duration(0.05), lambda _: publisher.publish(TFMessage([self.transform()])))
        self.set_box = rospy.ServiceProxy('/cuboid_mapping/set_box', SetBox)
        self.set_box.wait_for_service(PATIENCE_S)

    def tearDown(self):
        self.timer.shutdown()

    def transform(self):
        transform = TransformStamped()
        transform.header.stamp = rospy.Time.now()
        transform.header.frame_id = 'map'
        transform.child_frame_id = 'base_link'
        (transform.transform.translation.x, transform.transform.translation.y,
         transform.transform.translation.z) = self.position
        transform.transform.rotation.z = transform.transform.rotation.w = 0.5 ** 0.5  # Its rotation does not matter.
        return transform

    def put(self, occupancy, low, high):
        answer = self.set_box(SetBoxRequest(occupancy=occupancy, boxes=[Box(Point(*low), Point(*high))]))
        self.assertTrue(answer.info.success, answer.info.message)

    def expect(self, layer, costs):
        """Waits until the layer has these costs, by point."""
        end = time.monotonic() + PATIENCE_S
        while {point: layer.at(*point) for point in costs} != costs and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual({point: layer.at(*point) for point in costs}, costs)

    def test_moves_along_and_is_what_a_static_layer_needs(self):
        layer = StaticLayer()
        self.expect(layer, {(0.0, 0.0): NO_INFORMATION})
        self.assertEqual(layer.frame, 'map')
        self.assertGreaterEqual(layer.grid.width * layer.grid.resolution, 4.0 - 1e-3)

        time.sleep(1.0)  # Both topics connect.
        num_grids = layer.num_grids
        self.put(SetBoxRequest.FREE, (-1.5, -1.0, 0.0), (1.0, 1.0, 1.0))
        self.put(SetBoxRequest.OCCUPIED, (1.0, -1.0, 0.0), (1.2, 1.0, 1.0))
        self.put(SetBoxRequest.OCCUPIED, (-1.0, -1.0, 1.4), (-0.8, 1.0, 1.6))  # above the band
        self.put(SetBoxRequest.OCCUPIED, (0.0, -0.5, 0.0), (0.2, 0.5, 0.1))    # below it
        self.expect(layer, {(1.1, 0.0): LETHAL, (0.5, 0.0): FREE, (-0.9, 0.0): FREE, (0.1, 0.0): FREE,
                            (1.5, 1.5): NO_INFORMATION})
        self.assertEqual(layer.num_grids, num_grids, 'updates are enough')
        self.assertGreater(layer.num_updates, 0)

        self.position = [0.0, 0.0, 1.0]  # On a ramp: other heights at the same place.
        self.expect(layer, {(1.1, 0.0): NO_INFORMATION, (-0.9, 0.0): LETHAL, (0.1, 0.0): NO_INFORMATION})
        self.assertEqual(layer.num_grids, num_grids, 'updates are enough')

        self.position = [3.0, 0.2, 0.0]
        self.expect(layer, {(1.1, 0.0): LETHAL, (0.5, 0.0): None, (4.5, 0.0): NO_INFORMATION})
        self.assertGreater(layer.num_grids, num_grids)
        x = layer.grid.origin.position.x + 0.5 * layer.grid.width * layer.grid.resolution
        self.assertLess(abs(x - 3.0), 0.41, 'in the middle, but for half a brick')

        for subscriber in layer.subscribers:  # Subscribers of one process share a connection.
            subscriber.unregister()
        time.sleep(0.5)
        late = StaticLayer()
        self.expect(late, {(1.1, 0.0): LETHAL, (4.5, 0.0): NO_INFORMATION})
        self.assertEqual(late.costs, layer.costs)


if __name__ == '__main__':
    import rostest
    rospy.init_node('test_robot_grid')
    rostest.rosrun('cuboid_mapping', 'robot_grid', TestRobotGrid)
