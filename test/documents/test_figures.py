#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Figures quoted by README and doc/evaluation.md are in generated tables, and these come from the kept runs."""
import collections
import contextlib
import csv
import io
import json
import pathlib
import random
import re
import runpy
import statistics
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'scripts'))
from benchmark_document import OF_OTHER_COMMITS, Reports, exponent, median_interval, processes_block, times  # noqa: E402
from benchmark_runs import HEADLINES, Run, process_runs  # noqa: E402

SETTINGS = {'KITTI, 0.2 m': 'KITTI 0005, city, 0.2 m', 'Tor, 0.2 m': 'Mühlburger Tor, standing, 0.2 m',
            'fr079, 0.05 m': 'fr079, simulated, 0.05 m', 'RGB-D': '7-Scenes, RGB-D, 0.05 m'}
WHOLE_SETS = {'KITTI, 0.2 m': ('kitti_0005_city', 0.2, 26), 'Tor, 0.2 m': ('muehlburger_tor_standing', 0.2, 88),
              'fr079, 0.05 m': ('sim_fr079', 0.05, 33), 'RGB-D': ('rgbd_7scenes', 0.05, 7)}
INEXACT = 'Bonxai, own rays'


def read_rows(text):
    """The cells of each row of a page's tables, without heads."""
    rows = [[cell.strip() for cell in line.strip('|').split('|')]
            for line in text.splitlines() if line.startswith('|') and not re.match(r'\|[ -]*-', line)]
    return rows


def read_block(name, document='performance'):
    text = (ROOT / f'doc/{document}.md').read_text()
    (block,) = re.findall(rf'<!-- benchmark:begin {name} -->\n(.*?)<!-- benchmark:end -->', text, re.DOTALL)
    return read_rows(block)


def without_range(text):
    return text.partition(' (')[0]


def number(text):
    return float(re.match(r'[\d.,]+', text).group().replace(',', ''))


def ratios_of_nodes(runs, figure):
    """Medians of octomap_server over ours, of each pair of variants at the same setting."""
    values = collections.defaultdict(lambda: collections.defaultdict(list))
    for run in runs:
        values[tuple(run[key] for key in ('bag', 'resolution_m', 'max_range_m', 'listens'))][run['server']].append(figure(run))
    medians = [{name: statistics.median(of_runs) for name, of_runs in servers.items()} for servers in values.values()]
    return [theirs / ours for servers in medians for their_name, theirs in servers.items() for our_name, ours in servers.items()
            if their_name.startswith('octomap_server') and our_name.startswith('cuboid_mapping')]


class FiguresTest(unittest.TestCase):

    def setUp(self):
        self.text = (ROOT / 'README.md').read_text()
        self.figures = self.text[self.text.index('## Figures'):self.text.index('## The paper')]
        self.words = ' '.join(self.figures.split())

    def test_peers_of_the_headline_are_those_of_the_table_of_other_maps(self):
        maps = {}
        for name, title, *figures in read_block('peers', 'tables/performance')[1:]:
            maps.setdefault(name, {})[title] = figures
        rows = read_rows(self.figures)[1:]
        self.assertEqual([row[0] for row in rows], list(SETTINGS))
        for name, _, _, exact, other, peaks, cells in rows:
            with self.subTest(name):
                of_set = maps[SETTINGS[name]]
                exact_peers = {title: figures for title, figures in of_set.items() if figures[2] == '0' and 'OctoMap' not in title}
                best = min(exact_peers, key=lambda title: number(exact_peers[title][1]))
                self.assertEqual(exact, f"{without_range(exact_peers[best][1])} {best.split(',')[0]}")
                inexact = {title: figures for title, figures in of_set.items()
                           if figures[2] not in ('0', '-') and 'our voxels' not in title}
                self.assertEqual(min(inexact, key=lambda title: number(inexact[title][1])), INEXACT)
                share = re.search(r'\(([\d.]+%)\)', inexact[INEXACT][2]).group(1)
                self.assertEqual(other, f'{without_range(inexact[INEXACT][1])}, {share}')
                least = min(set(of_set) - {'here'}, key=lambda title: number(of_set[title][5]))
                self.assertEqual(peaks, ', '.join(of_set[title][5].replace(' MB', '') for title in ('here', 'OctoMap', least)))
                self.assertEqual(cells, f"{number(of_set['here'][3]) / number(of_set['OctoMap'][3]):.0%}")
                self.assertEqual([of_set[title][2] for title in ('OctoMap', 'OctoMap, lazy')], ['0', '0'])
        lazy = [number(of_set['OctoMap, lazy'][0]) / number(of_set['OctoMap'][0]) for of_set in maps.values()]
        self.assertIn(f'`lazy_eval` took {min(lazy):.2f} to {max(lazy):.2f} times', self.words)

    def test_octomap_in_the_headline_are_the_medians_of_processes_with_the_range_of_all_runs(self):
        """All runs: those of the kept reports with these settings."""
        here = {row[0]: row[2] for row in read_block('insertion')[1:]}
        medians = collections.defaultdict(list)  # Of a table for each machine.
        for row in read_block('processes', 'tables/performance'):
            if row[1] == 'OctoMap':
                medians[row[0]].append(without_range(row[3]))
        plain = {'max_range_m': None, 'every': 1, 'point_step': 1, 'laps': 1, 'threads': 1, 'branching': 32, 'environment': 'dynamic',
                 'fusion': 'class', 'fuse_every_cloud': False}
        ratios = {}
        for file in (ROOT / 'doc/performance').glob('*/*.json'):
            report = json.loads(file.read_text())
            maps = report.get('octomap'), report.get('cuboid_mapping')
            if all(maps) and all(report.get(name, value) == value for name, value in plain.items()):
                ratios.setdefault((report['dataset'], report['resolution_m'], report['clouds']), []).append(
                    maps[0]['insert_cpu_s'] / maps[1]['insert_cpu_s'])
        for name, ours, octomap, *_ in read_rows(self.figures)[1:]:
            with self.subTest(name):
                of_set = ratios[WHOLE_SETS[name]]
                self.assertGreater(len(of_set), 21)
                self.assertEqual([ours, octomap], [here[SETTINGS[name]],
                                                   f"{', '.join(medians[SETTINGS[name]])} ({times(min(of_set))} to {times(max(of_set))})"])

    def test_the_least_gains_are_those_of_the_reports(self):
        (commit,) = re.findall(r'EPYC.*commit `(\w+)`', (ROOT / 'doc/performance.md').read_text())
        for name, said in (('sim_fr079-resolution_0.4', '{:.1f} times (fr079, 0.4 m)'),
                           ('kitti_0005_city-resolution_0.2-clouds_6-max_range_5', '{:.1f} times (KITTI, six clouds, 5 m)')):
            report = json.loads((ROOT / 'doc/performance' / commit / f'{name}.json').read_text())
            self.assertIn(said.format(report['octomap']['insert_cpu_s'] / report['cuboid_mapping']['insert_cpu_s']), self.words)
        with open(ROOT / 'doc/evaluation/evaluation.csv', encoding='utf-8') as file:
            coarse = {row['fusion'] or row['map']: float(row['insert_cpu_s']) for row in csv.DictReader(file)
                      if row['dataset'] == 'sim_fr079' and float(row['resolution_m']) == 1 and (row['map'] == 'octomap' or row['fusion'] == 'class')}
        self.assertIn(f"(fr079, 0.4 m), {coarse['octomap'] / coarse['class']:.1f} times (1 m)", self.words)

    def test_nodes_at_recommended_settings_are_those_of_the_page(self):
        of_page = [row for row in read_rows((ROOT / 'doc/octomap_server.md').read_text()) if len(row) == 10 and row[3] in ('yes', 'no')]
        rows = [row for row in of_page if row[3] == 'no']
        self.assertEqual(len(rows), 9)
        of_bags = [number(rows[place][5]) / number(rows[place - place % 3 + 2][5]) for place in range(9) if place % 3 < 2]
        runs = json.loads((ROOT / 'doc/performance/octomap_server.json').read_text())['runs']
        of_rows = ratios_of_nodes(runs, lambda run: run['cpu_s'])
        self.assertGreater(len(of_rows), 35)
        self.assertIn(f'took {times(min(of_rows))} to {times(max(of_rows))} times our CPU time for a bag (', self.words)
        self.assertIn(f'without listeners {min(of_bags):.1f} to {max(of_bags):.1f}.', self.words)
        places = {'simulated drive': 'drive', 'KITTI 0005': 'kitti_0005_city', 'fr079': 'sim_fr079'}
        settings = {(places[row[0].split(',')[0]], number(row[1]), number(row[2])) for row in rows}
        usual = [run for run in runs if (run['bag'], run['resolution_m'], run['max_range_m']) in settings]
        listened = ratios_of_nodes([run for run in usual if run['listens']], lambda run: run['cpu_s'])
        self.assertEqual(len(listened), 12)
        self.assertIn(f'With one, {min(listened):.1f} to {max(listened):.1f}.', self.words)
        of_clouds = ratios_of_nodes(usual, lambda run: run['cpu_s'] / run['in_map'])
        self.assertEqual(len(of_clouds), 18)
        self.assertIn(f'took {min(of_clouds):.1f} to {max(of_clouds):.0f} times ours a cloud', self.words)
        inserted = [list(map(int, row[8].split(' of '))) for row in of_page]
        count, total = min(inserted, key=lambda counts: counts[0] / counts[1])
        self.assertIn(f'lost up to {total - count} of {total} clouds', self.words)


class EvaluationTest(unittest.TestCase):

    def setUp(self):
        text = (ROOT / 'doc/evaluation.md').read_text()
        self.text = ' '.join(re.sub(r'<!-- benchmark:begin.*?<!-- benchmark:end -->', '', text, flags=re.DOTALL).split())
        self.readme = (ROOT / 'README.md').read_text()
        heads = read_block('readings', 'tables/evaluation')[0][1:]
        self.readings = {row[0]: dict(zip(heads, map(number, row[1:]))) for row in read_block('readings', 'tables/evaluation')[1:]}

    def test_the_range_of_cells_in_readme_is_that_of_all_sets_and_resolutions(self):
        shares = [number(cell) for row in read_block('resolutions', 'evaluation') if row[1] == 'class'
                  for cell in row[2:] if cell != '-']
        self.assertEqual(len(shares), 26)
        least, greatest = re.search(r'\[(\d+) to (\d+) %\]\(doc/evaluation.md#[^)]*\)', self.readme).groups()
        self.assertEqual([int(least), int(greatest)], [round(min(shares)), round(max(shares))])

    def test_cells_beside_those_of_classes_alone_are_said_too(self):
        shares = []
        for report in (ROOT / 'doc/evaluation').glob('*_rate_distortion.json'):
            cells = {(row['map'], row['resolution_m']): row['cells'] for row in json.loads(report.read_text())['rows']}
            shares += [100 * count / cells['octomap, classes', edge_m] for (name, edge_m), count in cells.items()
                       if name == 'cuboid_mapping, classes']
        self.assertEqual(len(shares), 16)
        readme = ' '.join(self.readme.split())
        said = re.search(r'(\d+) to (\d+) % of those of an OctoMap with \[classes alone\]', readme).groups()
        self.assertEqual(list(map(int, said)), [round(min(shares)), round(max(shares))])

    def test_what_the_paper_to_the_letter_saves_is_that_of_the_readings(self):
        saved = re.search(r'To the letter: ([\d.]+) % fewer on muehlburger_tor_standing, ([\d.]+) % on sim_fr079, '
                          r'([\d.]+) % on rgbd_7scenes, and ([\d.]+) % \*\*more\*\* on kitti_0005_city', self.text).groups()
        written = self.readings['as written']
        self.assertEqual([float(value) for value in saved],
                         [round(value, 1) for value in (100 - written['muehlburger_tor_standing'], 100 - written['sim_fr079'],
                                                        100 - written['rgbd_7scenes'], written['kitti_0005_city'] - 100)])
        fewer, more = re.search(r'\[([\d.]+) % fewer cells than OctoMap\].* ([\d.]+) % more on KITTI', self.readme, re.DOTALL).groups()
        self.assertEqual([fewer, more], [saved[0], saved[3]])
        slower = {row[0]: 1 / number(row[6]) for row in read_block('repeats', 'tables/evaluation')[1:]
                  if row[2] == 'the paper, to the letter'}
        lines = (ROOT / 'doc/kept/letter_idle.txt').read_text().splitlines()
        start = next(place for place, line in enumerate(lines) if line.startswith('dataset,'))
        times = collections.defaultdict(dict)
        for row in csv.DictReader(lines[start:start + 7]):
            times[row['dataset']][row['map']] = float(row['insert_cpu_s'])
        (idle,) = {f"{maps['paper'] / maps['octomap']:.1f}" for maps in times.values()}
        self.assertEqual(set(times), {'muehlburger_tor_standing', 'kitti_0005_city'})
        self.assertIn(f"takes {slower['muehlburger_tor_standing']:.1f} and {slower['kitti_0005_city']:.1f} times OctoMap's time, "
                      f'and {idle} on a Xeon', ' '.join(self.readme.split()))
        voxel = self.readings['(5): by one voxel']
        self.assertIn(f"by one voxel ({100 - voxel['muehlburger_tor_standing']:.1f} and {100 - voxel['kitti_0005_city']:.1f} % fewer)",
                      self.readme)

    def test_why_an_r_tree_is_that_of_the_table_of_indexes(self):
        def ratios(column, *kinds):  # Of all data sets, which have three columns each.
            rows = [row for row in read_block('indexes', 'tables/evaluation')[1:] if any(kind in row[0] for kind in kinds)]
            return [number(row[place]) for row in rows for place in range(column, len(row), 3)]

        def expect(pattern, values, digits):
            said = list(map(number, re.search(pattern, self.text).groups()))
            self.assertEqual(said, [round(min(values), digits), round(max(values), digits)], pattern)

        hash_of_bricks, flat_list = 2, 3
        nearest = ratios(hash_of_bricks, 'nearest')
        expect(r'boxes and regions in ([\d.]+) to ([\d.]+) times', ratios(hash_of_bricks, 'boxes', 'regions', 'in 2 m'), 1)
        expect(r'visits in ([\d.]+) to ([\d.]+),', ratios(hash_of_bricks, 'visit'), 1)
        expect(r'graphs in ([\d.]+) to ([\d.]+),', [*(value for value in nearest if value < 1),
                                                    *ratios(hash_of_bricks, 'points', 'graphs')], 2)
        far = ratios(hash_of_bricks, 'nearest occupied, anywhere')
        self.assertIn(f'nearest of random places in {far[0]:.0f} and {far[1]:.1f} outdoors, {far[2]:.2f} and {far[3]:.2f} indoors;', self.text)
        expect(r'wins at visits \(([\d.]+) to ([\d.]+)\)', ratios(flat_list, 'visit'), 2)
        slower = [value for value in ratios(flat_list, 'boxes', 'in 2 m', 'regions', 'points', 'nearest', 'graphs') if value > 1]
        expect(r'elsewhere by ([\d.]+) to ([\d,]+) times', slower, 1)


class KeptRunsTest(unittest.TestCase):

    def expect_document(self, name, script, *options):
        """A document without its tables is restored from the kept runs."""
        pages = [pathlib.Path(f'{name}.md'), pathlib.Path(f'tables/{name}.md')]
        originals = [(ROOT / 'doc' / page).read_text() for page in pages]
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / 'tables').mkdir()
            copies = [pathlib.Path(folder) / page for page in pages]
            for copy, original in zip(copies, originals):
                copy.write_text(re.sub(r'(<!-- benchmark:begin \w+ -->\n).*?(?=<!-- benchmark:end -->)', r'\1', original, flags=re.DOTALL))
            subprocess.run([sys.executable, ROOT / 'scripts' / script, *options, '--document', copies[0]], check=True,
                           stdout=subprocess.DEVNULL)
            self.assertEqual([copy.read_text() for copy in copies], originals)

    def test_performance_md_is_made_of_the_reports_that_it_names(self):
        """Some tables may be of other commits, which stand below them."""
        blocks = dict(re.findall(r'<!-- benchmark:begin (\w+) -->\n(.*?)<!-- benchmark:end -->',
                                 ''.join((ROOT / 'doc' / page).read_text() for page in ('performance.md', 'tables/performance.md')),
                                 re.DOTALL))
        (commit,) = re.findall(r'commit `(\w+)`', blocks['machine'])
        options = ['--commit', commit]
        for name in OF_OTHER_COMMITS:
            if blocks[name] != 'Not measured.\n':
                for other_commit in re.findall(r'commit `(\w+)`', blocks[name]):
                    options += [f'--{name}-commit', other_commit]
        self.expect_document('performance', 'benchmark', '--only-document', '--results', ROOT / 'doc/performance', *options)

    def test_evaluation_md_is_made_of_the_runs_beside_it(self):
        self.expect_document('evaluation', 'evaluate', '--kept')


class ScalingTest(unittest.TestCase):

    def test_the_exponent_of_a_power_is_found_with_its_error(self):
        self.assertEqual(exponent([(x, 3 * x ** 1.5) for x in (1, 2, 4, 8)]), '1.50 ± 0.00')
        self.assertEqual(exponent([(1, 5), (2, 10)]), '1.00')
        self.assertEqual(exponent([(1, 1), (2, 4), (4, 8)]), '1.50 ± 0.29')
        self.assertEqual(exponent([(1, 1), (2, float('nan')), (4, 8)]), '-')


class ProcessesTest(unittest.TestCase):

    def test_the_interval_of_the_median_holds_it_with_at_least_95_percent(self):
        for count, left_out in ((6, 0), (8, 0), (9, 1), (10, 1), (20, 5), (100, 39)):
            values = list(range(count))
            random.Random(count).shuffle(values)
            self.assertEqual(median_interval(values), (left_out, count - 1 - left_out))
        self.assertIsNone(median_interval([1, 2, 3, 4, 5]))

    def test_each_headline_runs_once_in_each_round_in_a_random_order(self):
        runs = process_runs(4)
        rounds = [runs[start:start + len(HEADLINES)] for start in range(0, len(runs), len(HEADLINES))]
        orders = [[(run.dataset, run.resolution) for run in of_round] for of_round in rounds]
        self.assertEqual([sorted(order) for order in orders], 4 * [sorted(HEADLINES)])
        self.assertEqual(len(set(map(tuple, orders))), 4)
        self.assertEqual([{run.options['shuffle'] for run in of_round} for of_round in rounds], [{1}, {2}, {3}, {4}])
        self.assertEqual(len({run.name for run in runs}), len(runs))
        self.assertEqual([run.name for run in runs], [run.name for run in process_runs(5)[:len(runs)]])

    def test_ratios_are_those_of_each_process(self):
        def figures(number):
            rates = {'near_surface': 1 / number}
            return {'insert_cpu_s': number, 'bytes_heap': 10, 'access_occupied_s': number,
                    **{f'{kind}_queries_per_s': rates for kind in ('point', 'box', 'ray')}}

        with tempfile.TemporaryDirectory() as folder:
            for number, (own_s, peer_s) in enumerate([(1, 2), (10, 30), (1, 4), (2, 10), (1, 6), (1, 7)], 1):
                report = {'dataset': 'sim_fr079', 'resolution_m': 0.1, 'max_range_m': None, 'shuffle': number,
                          'machine': {'cpu': 'C', 'cores': 2, 'compiler': 'G', 'build_type': 'R', 'commit': '1'},
                          'cuboid_mapping': figures(own_s), 'octomap': figures(peer_s)}
                (pathlib.Path(folder) / f'{number}.json').write_text(json.dumps(report))
            rows = read_rows(processes_block(Reports(pathlib.Path(folder))))
        self.assertEqual(rows[1:], [['fr079, simulated, 0.1 m', 'OctoMap', '6', '4.50 (2.00 to 7.00)', '1.00 (1.00 to 1.00)',
                                     *4 * ['4.50 (2.00 to 7.00)']]])


class MissingDataTest(unittest.TestCase):

    def test_a_data_set_that_is_missing_fails_its_runs(self):
        run_all = runpy.run_path(str(ROOT / 'scripts/benchmark'))['run_all']
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(run_all([Run('missing', 0.1), Run('missing', 0.2)], pathlib.Path(folder), pathlib.Path(folder)), 2)


class NodesTest(unittest.TestCase):

    def test_the_tables_beside_octomap_server_are_those_of_the_kept_runs(self):
        kept = ROOT / 'doc/performance/octomap_server.json'
        table = subprocess.run([sys.executable, ROOT / 'campaign/beside_octomap_server', '--read', kept], check=True,
                               capture_output=True, text=True).stdout
        self.assertIn(table, (ROOT / 'doc/tables/performance.md').read_text())
        text = (ROOT / 'doc/octomap_server.md').read_text()
        rows = [line for line in text.splitlines() if re.match(r'\| .* Hz \|', line)]
        self.assertGreater(len(rows), 10)
        for row in rows:
            self.assertIn(row, table.splitlines())


if __name__ == '__main__':
    unittest.main()
