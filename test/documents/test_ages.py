#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Figures come from reports of commits in the history, and a table says which."""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOC = ROOT / 'doc'
sys.path.insert(0, str(ROOT / 'scripts'))
import figure_ages  # noqa: E402

REPORTS = [file for folder in ('performance', 'evaluation', 'kept') for file in sorted((DOC / folder).rglob('*'))
           if file.suffix in ('.json', '.csv', '.xz', '.txt')]
OF_OTHERS = ('data_sets.md',)  # Names commits of other repositories.
HAS_HISTORY = figure_ages.has_history()


def read_blocks(page):
    return re.findall(r'<!-- benchmark:begin (\w+) -->', page.read_text())


class SourcesTest(unittest.TestCase):
    """What needs no history."""

    def setUp(self):
        self.rows = figure_ages.read_table()

    def test_each_kept_report_belongs_to_figures(self):
        used = {file for row in self.rows for file in row.reports}
        for report in REPORTS:
            if report.suffix != '.xz' and figure_ages.commits_of(report):  # The archive has what stands beside it.
                self.assertIn(report, used)

    def test_each_generated_table_has_a_row(self):
        num_tables = 0
        for page in sorted(DOC.rglob('*.md')):
            titles = [title for row in self.rows if row.page == page for title in row.titles]
            for block in read_blocks(page):
                if block != 'machine':
                    num_tables += 1
                    self.assertIn(block, titles, page.name)
        self.assertGreater(num_tables, 20)


class KeepTest(unittest.TestCase):
    """scripts/keep, in a repository of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / 'source').write_text('1')
        self.git('init', '--quiet')
        self.git('add', 'source')
        self.git('-c', 'user.name=t', '-c', 'user.email=t', 'commit', '--quiet', '--message=t')

    def git(self, *arguments):
        return subprocess.run(['git', *arguments], cwd=self.folder, check=True, capture_output=True, text=True).stdout

    def keep(self, *command):
        return subprocess.run([ROOT / 'scripts/keep', 'kept/report.txt', *command], cwd=self.folder, capture_output=True, text=True)

    def test_a_report_has_its_commit_what_was_printed_and_the_status(self):
        self.assertEqual(self.keep('sh', '-c', 'echo 7 files in $PWD; exit 3').returncode, 3)
        text = (self.folder / 'kept/report.txt').read_text()
        self.assertEqual(figure_ages.commits_in(text), {self.git('rev-parse', '--short=10', 'HEAD').strip()})
        self.assertIn('\n7 files in .\n', text)
        self.assertTrue(text.endswith('exit status 3\n'), text)

    def test_lines_of_a_log_that_differ_in_numbers_only_are_there_once(self):
        self.keep('sh', '-c', 'for i in 1 2; do echo "[ INFO] [$i.5, 3.0]: $i cuboids"; echo "$i laps"; done; echo "[ WARN] [3.0]: 7 late"')
        self.assertIn('\n[ INFO] [1.5, 3.0]: 1 cuboids\n1 laps\n2 laps\n[ WARN] [3.0]: 7 late\n',
                      (self.folder / 'kept/report.txt').read_text())

    def test_a_report_can_be_made_again(self):
        self.keep('sh', '-c', 'echo "$0 files" >>files; cat files', '7')
        self.assertEqual(self.keep().returncode, 0)
        self.assertIn('\n7 files\n7 files\n', (self.folder / 'kept/report.txt').read_text())

    def test_reports_in_doc_can_be_made_anew_one_after_the_other(self):
        for name in ('first', 'second'):
            (self.folder / 'doc').mkdir(exist_ok=True)
            (self.folder / f'doc/{name}.txt').write_text('command true')
        self.git('add', 'doc')
        self.git('-c', 'user.name=t', '-c', 'user.email=t', 'commit', '--quiet', '--message=t')
        for name in ('first', 'second'):
            result = subprocess.run([ROOT / 'scripts/keep', f'doc/{name}.txt'], cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(result.returncode, 0, result.stderr)

    def test_without_a_command_and_a_report_it_asks_for_the_command(self):
        result = self.keep()
        self.assertEqual(result.returncode, 1)
        self.assertIn('name the command', result.stderr)

    def test_it_warns_of_a_commit_that_a_rebase_may_replace(self):
        self.git('branch', '--move', '--force', 'main')
        self.assertEqual(self.keep('true').stderr, '')
        self.git('checkout', '--quiet', '-b', 'work')
        (self.folder / 'source').write_text('2')
        self.git('-c', 'user.name=t', '-c', 'user.email=t', 'commit', '--quiet', '--all', '--message=t')
        self.assertIn('not on main', self.keep('true').stderr)

    def test_nothing_is_kept_of_changes_that_are_in_no_commit(self):
        (self.folder / 'source').write_text('2')
        result = self.keep('true')
        self.assertEqual(result.returncode, 1)
        self.assertIn('changes in no commit', result.stderr)
        self.assertFalse((self.folder / 'kept').exists())


@unittest.skipUnless(HAS_HISTORY, 'no history here, or a shallow one')
class HistoryTest(unittest.TestCase):

    def test_each_kept_report_is_of_a_commit_in_the_history(self):
        num_commits = 0
        for report in REPORTS:
            for commit in figure_ages.commits_of(report):
                num_commits += 1
                self.assertIsNotNone(figure_ages.date_of(commit), f'{report.name}: {commit}')
        self.assertGreater(num_commits, 50)

    def test_each_commit_that_a_page_names_is_in_the_history(self):
        num_commits = 0
        for page in [ROOT / 'README.md', *sorted(DOC.rglob('*.md'))]:
            if page.name in OF_OTHERS:
                continue
            for word in re.findall(r'\b(?=[0-9a-f]*\d)(?=[0-9a-f]*[a-f])[0-9a-f]{7,10}\b', page.read_text()):
                num_commits += 1
                self.assertIsNotNone(figure_ages.date_of(word), f'{page.name}: {word}')
        self.assertGreater(num_commits, 30)

    def test_the_table_says_at_which_commits_figures_were_measured(self):
        rows = figure_ages.read_table()
        self.assertGreater(len(rows), 30)
        text = figure_ages.TABLE.read_text()
        self.assertEqual(text, figure_ages.with_ages(text, rows), 'run scripts/figure_ages.py')

    def test_each_row_of_reliability_has_its_commit_and_date(self):
        text = (DOC / 'reliability.md').read_text()
        rows = [row for row in figure_ages.read_rows(text[text.index('## How it was tested'):])[0]]
        self.assertGreater(len(rows), 15)
        for row in rows:
            at = row[-1]
            for commit, date in re.findall(r'([0-9a-f]{7}), (\d{4}-\d\d-\d\d)', at):
                self.assertEqual(figure_ages.date_of(commit), date, row[0])
            self.assertRegex(at, r'^[0-9a-f]{7}, \d{4}-\d\d-\d\d', row[0])


if __name__ == '__main__':
    unittest.main()
