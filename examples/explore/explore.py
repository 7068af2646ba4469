#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Explores a building: drives from frontier to frontier, until the robot can reach no more of them.

Asks the mapping node for frontiers, and for corridors to them; unknown space is an obstacle. Publishes each path as
nav_msgs/Path on `path`, for the robot's controller. Parameters, lengths in metres:
~size    [x, y, z]: the robot's box
~height  height of its centre in the map: the robot stays on one floor
~region  [min x, min y, max x, max y]: the area to explore; the robot stays inside
~server  name of the mapping node (default cuboid_mapping)
"""
import argparse
import math

import rospy
import tf2_ros
from cuboid_mapping.msg import Box
from cuboid_mapping.srv import CheckBoxes, CheckPath, FindCorridor, GetFrontiers, SetBox, SetBoxRequest
from geometry_msgs.msg import Point, Vector3
from nav_msgs.msg import Path

TILE = 3.0           # Edge of a tile [m]. Frontiers are searched tile by tile, because one may run through the whole building.
MIN_VOXELS = 10      # Smaller frontiers are not worth a visit.
MAX_DISTANCE = 2.0   # Distance from a frontier to the place to look from [m].
VIEW_RANGE = 2.0     # Expected range of view from there [m].
STEP = 0.4           # Distance between places to look from [m].
ARRIVED = 0.1        # Distance to the goal that counts as arrived [m].
LOOK_TIME = 0.5      # Time for clouds from a new place [s].
PATIENCE = 40.0      # Time to wait for a way to open, such as a door [s].


class Explorer:

    def __init__(self):
        self.size = Vector3(*rospy.get_param('~size', [0.6, 0.6, 1.0]))
        self.height = rospy.get_param('~height', 0.7)
        min_x, min_y, max_x, max_y = rospy.get_param('~region')
        self.region = Box(Point(min_x, min_y, self.height - self.size.z / 2), Point(max_x, max_y, self.height + self.size.z / 2))
        self.check_boxes, self.check_path = self.service('check_boxes', CheckBoxes), self.service('check_path', CheckPath)
        self.find_corridor, self.set_box = self.service('find_corridor', FindCorridor), self.service('set_box', SetBox)
        self.get_frontiers = self.service('get_frontiers', GetFrontiers)
        self.paths = rospy.Publisher('path', Path, queue_size=1, latch=True)
        self.transforms = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.transforms)
        self.stands = [Point(x, y, self.height) for x in centers(min_x, max_x, self.size.x)
                       for y in centers(min_y, max_y, self.size.y)]
        self.visited = []  # Places.
        self.length = 0.0  # Length of all paths [m].

    @staticmethod
    def service(name, kind):
        name = f'{rospy.get_param("~server", "cuboid_mapping")}/{name}'
        rospy.wait_for_service(name)
        proxy = rospy.ServiceProxy(name, kind)

        def ask(**request):
            answer = proxy(**request)
            if not answer.info.success:
                raise rospy.ServiceException(f'{name}: {answer.info.message}')
            return answer
        return ask

    def explore(self):
        # The robot's own box is free, although its sensor may not see all of it.
        self.set_box(boxes=[self.body(self.locate())], occupancy=SetBoxRequest.FREE)
        begin = last_way = rospy.Time.now()
        while not rospy.is_shutdown():
            places = self.find_places()
            ways = self.find_ways(places)
            if ways:
                self.drive(max(ways, key=lambda way: way[0])[1])
                last_way = rospy.Time.now()
            elif (places or not self.visited) and (rospy.Time.now() - last_way).to_sec() < PATIENCE:
                rospy.sleep(1.0)
            else:
                self.report(places, (last_way - begin).to_sec())
                return

    def locate(self):
        """The centre of the robot's box in the map."""
        place = self.transforms.lookup_transform('map', 'base_link', rospy.Time(), rospy.Duration(10.0)).transform.translation
        return Point(place.x, place.y, self.height)

    def body(self, at):
        """The robot's box at a place."""
        x, y, z = self.size.x / 2, self.size.y / 2, self.size.z / 2
        return Box(Point(at.x - x, at.y - y, at.z - z), Point(at.x + x, at.y + y, at.z + z))

    def tiles(self):
        low, high = self.region.min, self.region.max
        for x in range(math.ceil((high.x - low.x) / TILE)):
            for y in range(math.ceil((high.y - low.y) / TILE)):
                yield Box(Point(low.x + x * TILE, low.y + y * TILE, low.z),
                          Point(min(low.x + (x + 1) * TILE, high.x), min(low.y + (y + 1) * TILE, high.y), high.z))

    def find_places(self):
        """(place, unknown volume in view) of each frontier with unknown volume in view, except near visited places."""
        blocked = self.check_boxes(boxes=[self.body(stand) for stand in self.stands]).blocked
        stands = [stand for stand, is_blocked in zip(self.stands, blocked) if not is_blocked]
        places = []
        for tile in self.tiles() if stands else ():
            answer = self.get_frontiers(region=tile, min_voxels=MIN_VOXELS, size=self.size, max_distance=MAX_DISTANCE,
                                        view_range=VIEW_RANGE)
            # The answer's place may be above the floor: take the nearest stand.
            places += [(min(stands, key=lambda stand: distance(stand, place)), volume)
                       for place, volume in zip(answer.place, answer.unknown_volume) if volume > 0.0]
        return [(place, volume) for place, volume in places
                if all(distance(place, old) > self.size.x for old in self.visited)]

    def find_ways(self, places):
        """(unknown volume in view per metre of path, corridor) of each reachable place."""
        start = self.locate()
        start.z = self.height
        corridors = [(volume, self.find_corridor(start=start, goal=place, size=self.size, clearance=self.size.x / 2,
                                                 start_tolerance=self.size.x, use_region=True, region=self.region))
                     for place, volume in places]
        return [(volume / (1.0 + corridor.length), corridor) for volume, corridor in corridors if corridor.path.poses]

    def drive(self, corridor):
        """Waits until the robot has arrived and looked around; returns early if the path becomes blocked."""
        # If an obstacle has come near, the path leads out of it first.
        waypoints = [pose.pose.position for pose in corridor.path.poses][corridor.start_distance > 0:]
        self.paths.publish(corridor.path)
        while distance(self.locate(), waypoints[-1]) > ARRIVED:
            rospy.sleep(0.2)
            if not self.check_path(waypoints=waypoints, size=self.size).free[0]:
                rospy.loginfo('the way is blocked: looking for another one')
                self.paths.publish(Path(header=corridor.path.header))
                return
        rospy.sleep(LOOK_TIME)
        self.visited.append(waypoints[-1])
        self.length += corridor.length

    def report(self, places, duration):
        volume = self.check_boxes(boxes=[self.region])
        for place, _ in places:
            rospy.logwarn('no way to a frontier seen from %.1f, %.1f', place.x, place.y)
        rospy.loginfo('explored in %.0f s: %d places, %.0f m, free %.1f m3, occupied %.1f m3, unknown %.1f m3', duration,
                      len(self.visited), self.length, volume.free_volume[0], volume.occupied_volume[0], volume.unknown_volume[0])


def centers(low, high, size):
    """Centres of robots inside an interval, STEP apart."""
    return [low + size / 2 + i * STEP for i in range(1 + int((high - low - size) / STEP))]


def distance(a, b):
    """Distance on the floor."""
    return math.hypot(a.x - b.x, a.y - b.y)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args(rospy.myargv()[1:])
    rospy.init_node('explore')
    try:
        Explorer().explore()
    except rospy.ROSInterruptException:
        pass  # Ctrl-C.
