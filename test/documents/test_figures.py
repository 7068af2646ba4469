#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Figures that README quotes stand in the generated tables of doc/performance.md."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
# How README names the settings of doc/performance.md.
SETTINGS = {'KITTI 0005, city, 26 clouds, 0.2 m': 'KITTI 0005, city, 0.2 m',
            'Mühlburger Tor, standing car, 88 clouds, 0.2 m': 'Mühlburger Tor, standing, 0.2 m',
            'fr079 corridor, simulated, 33 clouds, 0.05 m': 'fr079, simulated, 0.05 m',
            '7-Scenes, RGB-D, 7 clouds, 0.05 m': '7-Scenes, RGB-D, 0.05 m'}


def read_rows(text):
    """The cells of each row of its tables, without their heads."""
    rows = [[cell.strip() for cell in line.strip('|').split('|')]
            for line in text.splitlines() if line.startswith('|') and not re.match(r'\|[ -]*-', line)]
    return rows


def read_block(name):
    text = (ROOT / 'doc/performance.md').read_text()
    (block,) = re.findall(rf'<!-- benchmark:begin {name} -->\n(.*?)<!-- benchmark:end -->', text, re.DOTALL)
    return read_rows(block)


def number(text):
    return float(re.match(r'[\d.,]+', text).group().replace(',', ''))


class FiguresTest(unittest.TestCase):

    def setUp(self):
        self.text = (ROOT / 'README.md').read_text()
        self.figures = self.text[self.text.index('## Figures'):self.text.index('## Library')]

    def test_the_headline_is_that_of_performance_md(self):
        insertion = {row[0]: row for row in read_block('insertion')}
        memory = {row[0]: row for row in read_block('memory')}
        queries = {row[0]: row for row in read_block('queries')}
        rows = read_rows(self.figures)[1:]
        self.assertEqual([row[0] for row in rows], list(SETTINGS))
        for setting, octomap, here, ratio, leaves, cuboids, octomap_heap, heap, visit in rows:
            name = SETTINGS[setting]
            with self.subTest(name):
                self.assertEqual([here, octomap], insertion[name][2:4])
                self.assertEqual(number(ratio), number(insertion[name][4]))
                self.assertEqual(number(cuboids), number(memory[name][1]))
                self.assertAlmostEqual(number(leaves) / number(cuboids), number(memory[name][2]), delta=0.01)
                share = int(re.search(r'\((\d+)%\)', cuboids).group(1))
                self.assertAlmostEqual(share, 100 / number(memory[name][2]), delta=0.5)
                self.assertEqual([heap, octomap_heap], memory[name][4:6])
                self.assertEqual(visit, re.search(r'ms: (\d+)', queries[name][1]).group(1))

    def test_fusion_after_every_cloud_is_that_of_the_variants(self):
        quoted = re.search(r'Fused after every cloud, .* is (\d+) \(KITTI\), (\d+) \(.*?\) and ([\d.]+) ', self.figures)
        self.assertEqual(list(quoted.groups()), [row[4] for row in read_block('variants')[1:]])

    def test_the_range_of_the_queries_is_that_of_all_tables(self):
        ratios = [number(cell.split(': ')[1]) for row in read_block('queries')[1:] for cell in row[2:]]
        self.assertEqual(len(ratios), 36)
        least, greatest = re.search(r'are (\d+) to (\d+) times as fast', self.figures).groups()
        self.assertEqual(int(least), round(min(ratios)))
        self.assertEqual(int(greatest), round(max(ratios)))


if __name__ == '__main__':
    unittest.main()
