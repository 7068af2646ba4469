#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Waits while a map is built, then prints a summary of what /diagnostics says about it."""
import argparse
import sys
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray

START_TIMEOUT_S = 60.0  # For the first cloud.
QUIET_S = 6.0  # A bag has come to its end when no cloud arrives for so long.


class MapWatcher:
    """Keeps the latest figures of the mapping node, and when a cloud was last inserted."""

    def __init__(self):
        self.figures = {}
        self.last_cloud_s = None
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)

    def on_diagnostics(self, message):
        for status in message.status:
            figures = {pair.key: pair.value for pair in status.values}
            if 'clouds inserted' not in figures:
                continue
            if figures['clouds inserted'] != self.figures.get('clouds inserted', '0'):
                self.last_cloud_s = time.monotonic()
            self.figures = figures

    def number(self, key):
        return float(self.figures[key])


def wait_for_map(watcher, seconds, until_end_of_bag):
    """Returns False when no cloud was inserted."""
    start = time.monotonic()
    while watcher.last_cloud_s is None:
        if time.monotonic() - start > START_TIMEOUT_S or rospy.is_shutdown():
            return False
        time.sleep(0.2)
    first_cloud = time.monotonic()
    while not rospy.is_shutdown():
        now = time.monotonic()
        if until_end_of_bag and now - watcher.last_cloud_s > QUIET_S:
            break
        if not until_end_of_bag and now - first_cloud > seconds:
            break
        time.sleep(0.2)
    return True


def print_summary(watcher):
    cuboids = watcher.number('cuboids free') + watcher.number('cuboids occupied')
    voxels = watcher.number('voxels free') + watcher.number('voxels occupied')
    stages = ('convert', 'ray walk', 'apply and fuse')
    means = [watcher.number(stage + ' time mean [ms]') for stage in stages]
    print('clouds       {inserted} inserted, {dropped} dropped'.format(
        inserted=watcher.figures['clouds inserted'], dropped=watcher.figures['clouds dropped']))
    print(f'voxels       {voxels:.0f} known ({watcher.number("voxels occupied"):.0f} occupied)')
    print(f'cuboids      {cuboids:.0f} ({watcher.number("cuboids occupied"):.0f} occupied)')
    print(f'ratio        {voxels / max(cuboids, 1.0):.1f} voxels per cuboid')
    print(f'per cloud    {sum(means):.1f} ms (' +
          ', '.join(f'{stage} {mean:.1f}' for stage, mean in zip(stages, means)) + ')')
    print(f'memory       {watcher.number("map bytes") / 1e6:.1f} MB')


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=60.0, help='how long to wait')
    parser.add_argument('--until-end-of-bag', action='store_true',
                        help='wait until no more clouds come, instead')
    arguments = parser.parse_args()
    rospy.init_node('print_summary', anonymous=True, disable_signals=True)
    watcher = MapWatcher()
    if not wait_for_map(watcher, arguments.seconds, arguments.until_end_of_bag):
        return 1
    print_summary(watcher)
    return 0


if __name__ == '__main__':
    sys.exit(main())
