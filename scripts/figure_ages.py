#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes on the pages of doc/ how old their figures are: the commit, its date, and what has changed since.

usage: scripts/figure_ages.py

doc/tables/sources.md says which figures come from which reports, and depend on which sources. On each page, what
stands between <!-- ages:begin --> and <!-- ages:end --> is replaced. Needs the history: no shallow clone.
"""
import csv
import dataclasses
import functools
import io
import os
import pathlib
import re
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOC = ROOT / 'doc'
SOURCES = ('src', 'include', 'benchmark', 'scripts')  # Folders in which all sources are.
MARKS = re.compile(r'(<!-- ages:begin -->\n).*?(<!-- ages:end -->)', re.DOTALL)


# ---- The history ------------------------------------------------------------------------------


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


@functools.lru_cache(maxsize=None)
def old_files(commit):
    """Contents at a commit of the files that are other now, by their names; nothing for new ones."""
    names = git('diff', '--name-only', '--no-renames', commit, '--', *SOURCES).splitlines()
    asked = ''.join(f'{commit}:{name}\n' for name in names).encode()
    answer = io.BytesIO(subprocess.run(['git', 'cat-file', '--batch'], cwd=ROOT, check=True, input=asked, capture_output=True).stdout)
    files = {}
    for name in names:
        head = answer.readline().split()
        files[name] = ''
        if head[-1] != b'missing':
            files[name] = answer.read(int(head[-1])).decode(errors='replace')
            answer.readline()
    return files


def without_comments(name, code):
    code = re.sub(r'//.*' if name.endswith(('.h', '.cpp')) else r'#.*', '', code)
    return ''.join(code.split())


@functools.lru_cache(maxsize=None)
def code_of(name):
    file = ROOT / name
    return without_comments(name, file.read_text(errors='replace') if file.exists() else '')


def has_changed(commit, paths):
    """Whether files of these paths have other code than at a commit, comments apart."""
    return any(without_comments(name, old) != code_of(name) for name, old in old_files(commit).items()
               if any(name == path or name.startswith(path + '/') for path in paths))


# ---- The table --------------------------------------------------------------------------------


def commits_in(text):
    """The commits that a report names, in JSON, in CSV, or at its beginning (scripts/keep)."""
    if text.startswith('commit '):
        return {text.split()[1]}
    if text.lstrip().startswith('{'):
        return set(re.findall(r'"commit": ?"([^"]*)"', text))
    return {row['commit'] for row in csv.DictReader(io.StringIO(text)) if 'commit' in row}


def commits_of(report):
    """The commits of a kept report, or of all in an archive."""
    if report.suffix != '.xz':
        return commits_in(report.read_text())
    with tarfile.open(report) as archive:
        texts = [archive.extractfile(member).read().decode() for member in archive if member.isfile()]
    return set().union(*map(commits_in, texts))


@dataclasses.dataclass
class Figures:
    """A row of the table."""
    page: pathlib.Path
    titles: list
    reports: list  # Kept files; none if the figures were noted by hand.
    commits: list
    sources: dict  # Paths by the name of a source.
    excuse: str  # Why there is no report, or an older one; nothing if there must be one.

    def changed_sources(self):
        """Names of those that have changed since."""
        return list({name: None for commit in self.commits for name, paths in self.sources.items() if has_changed(commit, paths)})

    def age(self):
        """The row on the page."""
        commits = ', '.join(f'`{commit}` ({date_of(commit)})' for commit in self.commits)
        changed = self.changed_sources()
        hand = '' if self.reports else ', by hand'
        return f"| {', '.join(self.titles)} | {commits}{hand} | {', '.join(changed) or '-'} |"


def read_rows(text):
    tables = [[]]
    for line in text.splitlines():
        if not line.startswith('|'):
            tables.append([])
        elif not line.startswith('|-'):
            tables[-1].append([cell.strip() for cell in line.strip('|').split('|')])
    return [table[1:] for table in tables if table]


def paths_of(name, sets):
    """Paths by the names of sources: a set is listed by its folders, a program as one."""
    parts = sets.get(name)
    if parts is None:
        paths = [f'{root}/cuboid_mapping/{name}' for root in ('src', 'include')]
        return {name: [path for path in paths if (ROOT / path).exists()]}
    if '/' in parts[0]:
        return {name: parts}
    return {source: paths for part in parts if part != name or part not in sets
            for source, paths in paths_of(part, {key: value for key, value in sets.items() if key != name}).items()}


def read_table():
    """All rows, with the commits of their reports in the order of these."""
    figures, sets = read_rows((DOC / 'tables/sources.md').read_text())
    sets = {name.strip('`'): sources.replace('`', '').split() for name, sources in sets}
    rows = []
    for page, titles, reports, sources, excuse in figures:
        files, commits = [], reports.replace('by hand: ', '').split(', ')
        if not reports.startswith('by hand: '):
            files = [file for pattern in reports.split(', ') for file in sorted(DOC.glob(pattern))]
            commits = sorted(set().union(*map(cached_commits_of, files)))
        rows.append(Figures(DOC / page, titles.split(', '), files, commits,
                            {name: paths for source in sources.replace('`', '').split()
                             for name, paths in paths_of(source, sets).items()}, excuse))
    return rows


cached_commits_of = functools.lru_cache(maxsize=None)(commits_of)


def ages_of(page, rows):
    """What stands between the marks of a page."""
    table = os.path.relpath(DOC / 'tables/sources.md', page.parent)
    lines = [f'| [figures]({table}) | commit | changed since |', '|---|---|---|', *(row.age() for row in rows if row.page == page)]
    return '\n'.join(lines) + '\n'


def main():
    if len(sys.argv) > 1:
        sys.exit(__doc__)
    if not has_history():
        sys.exit('scripts/figure_ages.py: needs a clone of the repository with its history (git fetch --unshallow)')
    rows = read_table()
    gone = {f'{row.page.name}: {commit}' for row in rows for commit in row.commits if not date_of(commit)}
    if gone:
        sys.exit(f"scripts/figure_ages.py: commits that are not in the history: {', '.join(sorted(gone))}; measure anew, or take out what they gave")
    for page in {row.page: None for row in rows}:
        text = page.read_text()
        if not MARKS.search(text):
            sys.exit(f'scripts/figure_ages.py: {page} has no <!-- ages:begin --> and <!-- ages:end -->')
        page.write_text(MARKS.sub(lambda match: match[1] + ages_of(page, rows) + match[2], text))


if __name__ == '__main__':
    main()
