#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Waits while a map is built and shows progress, then prints a summary of /diagnostics.

With drops, the summary says why clouds were dropped and what would help.
"""
import argparse
import sys
import time

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray

START_TIMEOUT_S = 60.0  # For the master, and for the first cloud.
QUIET_S = 6.0  # A bag has come to its end when nothing happens to its clouds for so long.
STUCK_S = 30.0  # The same, while clouds still wait.
DRAW_PER_S = 20000  # Cuboids that rviz draws without a graphics card.
PROGRESS_S = 5.0  # Between two lines of progress.


def wait_for_master():
    """Quietly, as rospy does not. Returns False when there is none for too long."""
    start = time.monotonic()
    while not rosgraph.is_master_online():
        if time.monotonic() - start > START_TIMEOUT_S:
            print('no cloud was inserted: there is no ROS master')
            return False
        time.sleep(0.2)
    return True


class MapWatcher:
    """Keeps the latest figures of the mapping node, and when a cloud was last inserted."""

    def __init__(self):
        self.figures = {}
        self.message = ''
        self.last_cloud_s = None  # When a cloud was inserted,
        self.last_event_s = None  # or received.
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)

    def on_diagnostics(self, message):
        for status in message.status:
            figures = {pair.key: pair.value for pair in status.values}
            if 'clouds inserted' not in figures:
                continue
            now = time.monotonic()
            if figures['clouds inserted'] != self.figures.get('clouds inserted', '0'):
                self.last_cloud_s = self.last_event_s = now
            if figures['clouds received'] != self.figures.get('clouds received', '0'):
                self.last_event_s = now
            self.figures = figures
            self.message = status.message

    def is_over(self):
        """Whether a bag has come to its end, and its clouds are in the map."""
        quiet_s = time.monotonic() - self.last_event_s
        return quiet_s > (QUIET_S if self.number('clouds waiting') == 0 else STUCK_S)

    def number(self, key):
        return float(self.figures[key])


def wait_for_map(watcher, seconds, until_end_of_bag):
    """Returns False when no cloud was inserted."""
    start = time.monotonic()
    while watcher.last_cloud_s is None:
        if time.monotonic() - start > START_TIMEOUT_S or rospy.is_shutdown():
            print('no cloud was inserted:', watcher.message or 'the node does not answer')
            return False
        time.sleep(0.2)
    first_cloud = last_line = time.monotonic()
    while not rospy.is_shutdown():
        now = time.monotonic()
        if now - last_line > PROGRESS_S:
            last_line = now
            print_progress(watcher, now - first_cloud)
        if until_end_of_bag and watcher.is_over():
            break
        if not until_end_of_bag and now - first_cloud > seconds:
            break
        time.sleep(0.2)
    return True


def print_progress(watcher, seconds):
    print('{:5.0f} s      {} clouds inserted, {} dropped'.format(
        seconds, watcher.figures['clouds inserted'], watcher.figures['clouds dropped']), flush=True)


def print_drops(watcher):
    """A line for each reason, and one with the cure."""
    prefix = 'clouds dropped, '
    for key, value in watcher.figures.items():
        if key.startswith(prefix) and value != '0':
            print(f'dropped      {value} ({key[len(prefix):]})')
    if 'next step' in watcher.figures:
        print('advice      ', watcher.figures['next step'])


def print_summary(watcher):
    cuboids = watcher.number('cuboids free') + watcher.number('cuboids occupied')
    voxels = watcher.number('voxels free') + watcher.number('voxels occupied')
    stages = ('convert', 'ray walk', 'apply')
    means = [watcher.number(stage + ' time mean [ms]') for stage in stages]
    print('clouds       {inserted} inserted, {dropped} dropped'.format(
        inserted=watcher.figures['clouds inserted'], dropped=watcher.figures['clouds dropped']))
    print_drops(watcher)
    print(f'voxels       {voxels:.0f} known ({watcher.number("voxels occupied"):.0f} occupied)')
    print(f'cuboids      {cuboids:.0f} ({watcher.number("cuboids occupied"):.0f} occupied)')
    print(f'ratio        {voxels / max(cuboids, 1.0):.1f} voxels per cuboid')
    print(f'per cloud    {sum(means):.1f} ms (' +
          ', '.join(f'{stage} {mean:.1f}' for stage, mean in zip(stages, means)) + ')')
    print(f'memory       {watcher.number("map bytes") / 1e6:.1f} MB')


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n', 1)[0])
    parser.add_argument('--seconds', type=float, default=60.0, help='time to wait, in seconds')
    parser.add_argument('--until-end-of-bag', action='store_true',
                        help='wait until no more clouds come')
    arguments = parser.parse_args()
    if not wait_for_master():
        return 1
    rospy.init_node('print_summary', anonymous=True, disable_signals=True)
    watcher = MapWatcher()
    if not wait_for_map(watcher, arguments.seconds, arguments.until_end_of_bag):
        return 1
    print_summary(watcher)
    # rviz needs some time to draw the cuboids.
    time.sleep(min(60.0, 2.0 + watcher.number('cuboids occupied') / DRAW_PER_S))
    return 0


if __name__ == '__main__':
    sys.exit(main())
