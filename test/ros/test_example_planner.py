#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The example planner finds a path to a goal again whenever a door closes or opens."""
import threading
import unittest

import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Point, PoseStamped, TransformStamped
from nav_msgs.msg import Path
from rosgraph_msgs.msg import Log
from visualization_msgs.msg import MarkerArray

from cuboid_mapping.msg import Box
from cuboid_mapping.srv import SetBox, SetBoxRequest

DOOR = ((2, 1, 0), (2.2, 1.8, 2))


class ExamplePlannerTest(unittest.TestCase):

    def setUp(self):
        rospy.wait_for_service('/cuboid_mapping/set_box', 60.0)
        robot = self.make_transform('base_link', 0.5, 0.5)
        self.broadcaster = tf2_ros.StaticTransformBroadcaster()
        self.broadcaster.sendTransform([robot, self.make_transform('odom', 2.0, 0.0)])
        self.changed = threading.Condition()
        self.log = []
        rospy.Subscriber('/rosout', Log, self.on_log)
        self.goals = rospy.Publisher('/move_base_simple/goal', PoseStamped, queue_size=1, latch=True)
        self.path = self.corridor = None
        rospy.Subscriber('path', Path, self.on_path)
        rospy.Subscriber('corridor', MarkerArray, self.on_corridor)

    @staticmethod
    def make_transform(child, x, y):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.header.stamp = 'map', rospy.Time.now()
        transform.transform.translation.x, transform.transform.translation.y = x, y
        transform.transform.rotation.w = 1.0
        return transform

    def on_log(self, line):
        with self.changed:
            self.log.append(line.msg)
            self.changed.notify_all()

    def expect_log(self, part):
        self.expect(lambda: any(part in line for line in self.log))

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
            boxes=[Box(Point(*low), Point(*high))], occupancy=occupancy)
        self.assertTrue(answer.info.success, answer.info.message)

    def expect(self, condition):
        with self.changed:
            self.assertTrue(self.changed.wait_for(condition, 60.0))

    def has_way(self):
        return self.path is not None and len(self.path.poses) > 1

    def has_no_way(self):
        return self.path is not None and not self.path.poses

    def make_room(self):
        """A free room with solid walls around it; a wall in the middle with a door."""
        self.set_box((-1, -1, -1), (5, 3, 3), SetBoxRequest.OCCUPIED)
        self.set_box((0, 0, 0), (4, 2, 2), SetBoxRequest.FREE)
        self.set_box((2, 0, 0), (2.2, 2, 2), SetBoxRequest.OCCUPIED)
        self.set_box(*DOOR, SetBoxRequest.FREE)

    def click(self, x, y, frame_id='map'):
        goal = PoseStamped()
        goal.header.frame_id = frame_id
        goal.pose.position.x, goal.pose.position.y = x, y
        goal.pose.orientation.w = 1.0
        with self.changed:
            self.path = self.corridor = None
        self.goals.publish(goal)

    def place_of(self, ns):
        """Position of a marker of this namespace; None without one."""
        for marker in self.corridor.markers if self.corridor else ():
            if marker.ns == ns:
                return marker.pose.position
        return None

    def test_plans_anew_as_a_door_closes_and_opens(self):
        self.make_room()
        self.click(3.5, 0.5)
        self.expect(self.has_way)
        self.assertEqual(self.path.header.frame_id, 'map')
        positions = [pose.pose.position for pose in self.path.poses]
        self.assertAlmostEqual(positions[0].x, 0.5)
        self.assertAlmostEqual(positions[-1].x, 3.5)
        self.assertGreaterEqual(max(position.y for position in positions), 1.25 - 1e-3)
        self.expect(lambda: self.corridor is not None and len(self.corridor.markers) > 2)
        for _ in range(2):
            self.set_box(*DOOR, SetBoxRequest.OCCUPIED)
            self.expect(self.has_no_way)
            self.expect_log('NO_WAY: there is no way through free space')
            self.set_box(*DOOR, SetBoxRequest.FREE)
            self.expect(self.has_way)

    def test_takes_a_goal_in_any_frame_and_draws_it(self):
        self.make_room()
        self.click(1.5, 0.5, 'odom')  # 2 m behind the map's origin
        self.expect(self.has_way)
        self.assertAlmostEqual(self.path.poses[-1].pose.position.x, 3.5)
        self.expect(lambda: self.place_of('goal') is not None)
        self.assertAlmostEqual(self.place_of('goal').x, 3.5)
        self.assertAlmostEqual(self.place_of('robot').x, 0.5)

    def test_refuses_a_goal_that_is_no_number(self):
        self.make_room()
        self.click(float('nan'), 0.5)
        self.expect_log('goal ignored: its position is not finite')

    def test_unknown_space_is_an_obstacle(self):
        self.make_room()
        self.set_box((2.2, 0, 0), (4, 2, 2), SetBoxRequest.UNKNOWN)
        self.click(3.5, 0.5)
        self.expect(self.has_no_way)
        self.expect_log('GOAL_BLOCKED: there is an obstacle or unknown space at the goal')


if __name__ == '__main__':
    rospy.init_node('clicked_goal')
    rostest.rosrun('cuboid_mapping', 'clicked_goal', ExamplePlannerTest)
