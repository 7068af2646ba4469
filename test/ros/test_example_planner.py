#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The example planner: a path to a goal, found anew as a door closes and opens."""
import threading
import unittest

import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Point, PoseStamped, TransformStamped
from nav_msgs.msg import Path
from visualization_msgs.msg import MarkerArray

from cuboid_mapping.srv import SetBox, SetBoxRequest


class ExamplePlannerTest(unittest.TestCase):

    def setUp(self):
        rospy.wait_for_service('/cuboid_mapping/set_box', 60.0)
        robot = TransformStamped(child_frame_id='base_link')
        robot.header.frame_id, robot.header.stamp = 'map', rospy.Time.now()
        robot.transform.translation.x = robot.transform.translation.y = 0.5
        robot.transform.rotation.w = 1.0
        self.broadcaster = tf2_ros.StaticTransformBroadcaster()
        self.broadcaster.sendTransform(robot)
        self.changed = threading.Condition()
        self.path = self.corridor = None
        rospy.Subscriber('path', Path, self.on_path)
        rospy.Subscriber('corridor', MarkerArray, self.on_corridor)

    def on_path(self, path):
        with self.changed:
            self.path = path
            self.changed.notify_all()

    def on_corridor(self, corridor):
        with self.changed:
            self.corridor = corridor
            self.changed.notify_all()

    def set_box(self, low, high, occupancy):
        answer = rospy.ServiceProxy('/cuboid_mapping/set_box', SetBox)(
            min=[Point(*low)], max=[Point(*high)], occupancy=occupancy)
        self.assertTrue(answer.success, answer.message)

    def expect(self, condition):
        with self.changed:
            self.assertTrue(self.changed.wait_for(condition, 60.0))

    def has_way(self):
        return self.path is not None and len(self.path.poses) > 1

    def has_no_way(self):
        return self.path is not None and not self.path.poses

    def test_plans_anew_as_a_door_closes_and_opens(self):
        # A free room with solid walls around it; a wall in the middle with a door.
        self.set_box((-1, -1, -1), (5, 3, 3), SetBoxRequest.OCCUPIED)
        self.set_box((0, 0, 0), (4, 2, 2), SetBoxRequest.FREE)
        self.set_box((2, 0, 0), (2.2, 2, 2), SetBoxRequest.OCCUPIED)
        door = ((2, 1, 0), (2.2, 1.8, 2))
        self.set_box(*door, SetBoxRequest.FREE)
        publisher = rospy.Publisher('/move_base_simple/goal', PoseStamped, queue_size=1, latch=True)
        goal = PoseStamped()
        goal.header.frame_id = 'map'
        goal.pose.position.x, goal.pose.position.y = 3.5, 0.5
        goal.pose.orientation.w = 1.0
        publisher.publish(goal)

        self.expect(self.has_way)
        self.assertEqual(self.path.header.frame_id, 'map')
        positions = [pose.pose.position for pose in self.path.poses]
        self.assertAlmostEqual(positions[0].x, 0.5)
        self.assertAlmostEqual(positions[-1].x, 3.5)
        self.assertGreaterEqual(max(position.y for position in positions), 1.25 - 1e-3)
        self.expect(lambda: self.corridor is not None and len(self.corridor.markers) > 2)
        for _ in range(2):
            self.set_box(*door, SetBoxRequest.OCCUPIED)
            self.expect(self.has_no_way)
            self.set_box(*door, SetBoxRequest.FREE)
            self.expect(self.has_way)


if __name__ == '__main__':
    rospy.init_node('clicked_goal')
    rostest.rosrun('cuboid_mapping', 'clicked_goal', ExamplePlannerTest)
