#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes into doc/tables/sources.md at which commits, and when, the figures of the pages were measured.

usage: scripts/figure_ages.py

The kept reports name their commits. Needs the history: no shallow clone.
"""
import csv
import dataclasses
import functools
import io
import pathlib
import re
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOC = ROOT / 'doc'
TABLE = DOC / 'tables/sources.md'


def git(*arguments):
    return subprocess.run(['git', *arguments], cwd=ROOT, check=True, capture_output=True, text=True, errors='replace').stdout


def has_history():
    """Whether ROOT is a work tree of its own with all commits."""
    try:
        is_own = pathlib.Path(git('rev-parse', '--show-toplevel').strip()).resolve() == ROOT
        return is_own and git('rev-parse', '--is-shallow-repository').strip() == 'false'
    except (FileNotFoundError, subprocess.CalledProcessError):
        return False


@functools.lru_cache(maxsize=None)
def date_of(commit):
    """Day of a commit; nothing if HEAD does not follow it."""
    try:
        git('merge-base', '--is-ancestor', commit, 'HEAD')
        return git('log', '-1', '--format=%as', commit).strip()
    except subprocess.CalledProcessError:
        return None


def commits_in(text):
    """The commits that a report names, in JSON, in CSV, or at its beginning (scripts/keep)."""
    if text.startswith('commit '):
        return {text.split()[1]}
    if text.lstrip().startswith('{'):
        return set(re.findall(r'"commit": ?"([^"]*)"', text))
    return {row['commit'] for row in csv.DictReader(io.StringIO(text)) if 'commit' in row}


@functools.lru_cache(maxsize=None)
def commits_of(report):
    """The commits of a kept report, or of all in an archive."""
    if report.suffix != '.xz':
        return commits_in(report.read_text())
    with tarfile.open(report) as archive:
        texts = [archive.extractfile(member).read().decode() for member in archive if member.isfile()]
    return set().union(*map(commits_in, texts))


def read_rows(text):
    tables = [[]]
    for line in text.splitlines():
        if not line.startswith('|'):
            tables.append([])
        elif not line.startswith('|-'):
            tables[-1].append([cell.strip() for cell in line.strip('|').split('|')])
    return [table[1:] for table in tables if table]


@dataclasses.dataclass
class Figures:
    """A row of the table."""
    page: pathlib.Path
    titles: list
    patterns: list  # Of kept reports, below doc/.

    @property
    def reports(self):
        return [file for pattern in self.patterns for file in sorted(DOC.glob(pattern))]

    def row(self):
        """The row as it should be."""
        commits = sorted(set().union(*map(commits_of, self.reports)))
        ages = ', '.join(f'`{commit}` ({date_of(commit)})' for commit in commits)
        return f"| {self.page.relative_to(DOC)} | {', '.join(self.titles)} | {', '.join(self.patterns)} | {ages} |"


def read_table():
    (rows,) = read_rows(TABLE.read_text())
    return [Figures(DOC / page, titles.split(', '), patterns.split(', ')) for page, titles, patterns, _ in rows]


def with_ages(text, rows):
    """The text of the table's page with rows as they should be."""
    lines = text.splitlines()
    start = next(place for place, line in enumerate(lines) if line.startswith('|---')) + 1
    return '\n'.join([*lines[:start], *(row.row() for row in rows), *lines[start + len(rows):]]) + '\n'


def main():
    if len(sys.argv) > 1:
        sys.exit(__doc__)
    if not has_history():
        sys.exit('scripts/figure_ages.py: needs a clone of the repository with its history (git fetch --unshallow)')
    TABLE.write_text(with_ages(TABLE.read_text(), read_table()))


if __name__ == '__main__':
    main()
