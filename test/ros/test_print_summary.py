#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""scripts/print_summary.py reads everything that it needs from the diagnostics of the node."""
import os
import pathlib
import re
import subprocess
import sys
import unittest

import rostest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / 'scripts/print_summary.py'


class PrintSummaryTest(unittest.TestCase):

    def test_the_demo_ends_with_a_summary(self):
        self.check_summary('--seconds', '2')

    def test_a_bag_ends_with_a_summary_when_no_more_clouds_come(self):
        self.check_summary('--until-end-of-bag')

    def check_summary(self, *options):
        end = subprocess.run([sys.executable, str(SCRIPT), *options],
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
        text = end.stdout.decode()
        self.assertEqual(end.returncode, 0, text + end.stderr.decode())
        figures = dict(line.split(maxsplit=1) for line in text.splitlines())
        self.assertRegex(figures['clouds'], r'^[1-9]\d* inserted, \d+ dropped$')
        for name, pattern in [('voxels', r'^(\d+) known'), ('cuboids', r'^(\d+) \(\d+ occupied'),
                              ('ratio', r'^([\d.]+) voxels per cuboid'),
                              ('memory', r'^([\d.]+) MB')]:
            match = re.match(pattern, figures[name])
            self.assertTrue(match, text)
            self.assertGreater(float(match.group(1)), 0.0, text)
        self.assertRegex(figures['per'], r'^cloud +[\d.]+ ms \(convert [\d.]+, ray walk [\d.]+, apply')

    def test_it_waits_for_the_master_without_a_word(self):
        waiting = subprocess.Popen([sys.executable, str(SCRIPT)], stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT,
                                   env={**os.environ, 'ROS_MASTER_URI': 'http://localhost:1'})
        with self.assertRaises(subprocess.TimeoutExpired):
            waiting.communicate(timeout=5)
        waiting.kill()
        self.assertEqual(waiting.communicate()[0], b'')


if __name__ == '__main__':
    rostest.rosrun('cuboid_mapping', 'print_summary', PrintSummaryTest)
