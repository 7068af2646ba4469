#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Figures quoted by README and doc/evaluation.md are in generated tables, and these come from the kept runs."""
import collections
import contextlib
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
from benchmark_document import Reports, exponent, median_interval, processes_block  # noqa: E402
from benchmark_runs import HEADLINES, Run, all_runs, process_runs, scaling_runs  # noqa: E402


def read_rows(text):
    """The cells of each row of a page's tables, without heads."""
    rows = [[cell.strip() for cell in line.strip('|').split('|')]
            for line in text.splitlines() if line.startswith('|') and not re.match(r'\|[ -]*-', line)]
    return rows


def read_block(name, document='performance'):
    text = (ROOT / f'doc/{document}.md').read_text()
    (block,) = re.findall(rf'<!-- benchmark:begin {name} -->\n(.*?)<!-- benchmark:end -->', text, re.DOTALL)
    return read_rows(block)


def number(text):
    return float(re.match(r'[\d.,]+', text).group().replace(',', ''))


def cloud_ms(of_server):
    return 1000 * statistics.median(run['cpu_s'] / run['in_map'] for run in of_server)


class ReadmeTest(unittest.TestCase):

    def fastest(self, runs, setting, is_ours, listens):
        """The runs of one server; octomap_server's are those of its faster setting."""
        of_servers = collections.defaultdict(list)
        for run in runs:
            if ((run['bag'], run['resolution_m'], run['max_range_m']) == setting and run['listens'] == listens
                    and (run['server'] == 'cuboid_mapping') == is_ours):
                of_servers[run['server']].append(run)
        return min(of_servers.values(), key=cloud_ms)

    def test_its_nodes_are_the_medians_of_the_kept_runs_with_octomap_server_at_its_faster_setting(self):
        text = (ROOT / 'README.md').read_text()
        rows = read_rows(text[text.index('## How fast'):text.index('## The paper')])[1:]
        runs = json.loads((ROOT / 'doc/performance/octomap_server.json').read_text())['runs']
        settings = [('kitti_0005_city', 0.2, 50), ('sim_fr079', 0.05, 5), ('drive', 0.1, 5)]
        self.assertEqual(len(rows), len(settings))
        for row, setting in zip(rows, settings):
            cells = []
            for is_ours in (False, True):
                alone, heard = (self.fastest(runs, setting, is_ours, listens) for listens in (False, True))
                cells.append([f'{cloud_ms(alone):.0f}', f'{cloud_ms(heard):.0f}', f"{statistics.median(run['peak_mb'] for run in alone):.0f}",
                              f"{statistics.median(run['in_map'] for run in alone):.0f}"])
            units = ('ms', 'ms', 'MB', f"of {alone[0]['clouds']}")
            with self.subTest(setting=setting):
                self.assertEqual([cell.replace('*', '') for cell in row[1:]],
                                 [f'{octomap_server} / {ours} {unit}' for octomap_server, ours, unit in zip(*cells, units)])


class EvaluationTest(unittest.TestCase):

    def setUp(self):
        text = (ROOT / 'doc/evaluation.md').read_text()
        self.text = ' '.join(re.sub(r'<!-- benchmark:begin.*?<!-- benchmark:end -->', '', text, flags=re.DOTALL).split())
        heads = read_block('readings', 'tables/evaluation')[0][1:]
        self.readings = {row[0]: dict(zip(heads, map(number, row[1:]))) for row in read_block('readings', 'tables/evaluation')[1:]}

    def test_what_the_paper_to_the_letter_saves_is_that_of_the_readings(self):
        saved = re.search(r'To the letter: ([\d.]+) % fewer on muehlburger_tor_standing, ([\d.]+) % on sim_fr079, '
                          r'([\d.]+) % on rgbd_7scenes, and ([\d.]+) % \*\*more\*\* on kitti_0005_city', self.text).groups()
        written = self.readings['as written']
        self.assertEqual([float(value) for value in saved],
                         [round(value, 1) for value in (100 - written['muehlburger_tor_standing'], 100 - written['sim_fr079'],
                                                        100 - written['rgbd_7scenes'], written['kitti_0005_city'] - 100)])

    def test_why_an_r_tree_is_that_of_the_table_of_indexes(self):
        def ratios(column, *kinds):  # Of both data sets, which have three columns each.
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
        self.assertIn(f'nearest of random places in {far[0]:.0f} outdoors, {far[1]:.2f} indoors;', self.text)
        expect(r'wins at visits \(([\d.]+) to ([\d.]+)\)', ratios(flat_list, 'visit'), 2)
        slower = [value for value in ratios(flat_list, 'boxes', 'in 2 m', 'regions', 'points', 'nearest', 'graphs') if value > 1]
        expect(r'elsewhere by ([\d.]+) to ([\d,]+) times', slower, 1)


class KeptRunsTest(unittest.TestCase):

    def expect_document(self, name, script, *options, pages=()):
        """A document without its tables is restored from the kept runs. @param pages  More pages that the script fills in."""
        pages = [pathlib.Path(f'{name}.md'), pathlib.Path(f'tables/{name}.md'), *map(pathlib.Path, pages)]
        originals = [(ROOT / 'doc' / page).read_text() for page in pages]
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / 'tables').mkdir()
            copies = [pathlib.Path(folder) / page for page in pages]
            for copy, original in zip(copies, originals):
                copy.write_text(re.sub(r'(<!-- benchmark:begin \w+ -->\n).*?(?=<!-- benchmark:end -->)', r'\1', original, flags=re.DOTALL))
            subprocess.run([sys.executable, ROOT / 'scripts' / script, *options, '--document', copies[0]], check=True,
                           stdout=subprocess.DEVNULL)
            self.assertEqual([copy.read_text() for copy in copies], originals)

    def test_performance_md_is_made_of_the_reports_of_the_commit_that_it_names(self):
        (commit,) = re.findall(r'commit `(\w+)`', (ROOT / 'doc/performance.md').read_text())
        self.expect_document('performance', 'benchmark', '--only-document', '--results', ROOT / 'doc/performance', '--commit', commit)

    def test_each_report_is_of_a_run(self):
        runs = {run.name for run in [*all_runs(is_quick=False), *scaling_runs(is_large=True)]}
        self.assertEqual({report.stem for report in (ROOT / 'doc/performance').glob('*/*.json')} - runs, set())

    def test_evaluation_md_and_the_table_of_the_method_are_made_of_the_runs_beside_them(self):
        self.expect_document('evaluation', 'evaluate', '--kept', pages=['method.md'])


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
        self.assertEqual(rows[1:], [['fr079, 0.1 m', '6', '4.50 (2.00 to 7.00)', '1.00 (1.00 to 1.00)',
                                     *2 * ['4.50 (2.00 to 7.00)']]])


class RunAgainTest(unittest.TestCase):

    def test_a_report_of_fewer_repetitions_is_made_anew(self):
        is_there = runpy.run_path(str(ROOT / 'scripts/benchmark'))['is_there']
        with tempfile.TemporaryDirectory() as folder:
            report = pathlib.Path(folder) / 'sim_fr079-resolution_0.1.json'
            self.assertFalse(is_there(report, 1))
            report.write_text(json.dumps({'repeat': 1}))
            self.assertTrue(is_there(report, 1))
            self.assertFalse(is_there(report, 3))


class MissingDataTest(unittest.TestCase):

    def test_a_data_set_that_is_missing_fails_its_runs(self):
        run_all = runpy.run_path(str(ROOT / 'scripts/benchmark'))['run_all']
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(run_all([Run('missing', 0.1), Run('missing', 0.2)], pathlib.Path(folder), pathlib.Path(folder)), 2)


if __name__ == '__main__':
    unittest.main()
