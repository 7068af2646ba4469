#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs clang-tidy over the sources, many in one translation unit.

usage: scripts/lint_batches.py          needs a configured build/ (scripts/build)

clang-tidy spends nearly all its time on the headers of each unit. Here one file includes the sources of a group, so that
clang-tidy reads their headers once. Macros rename names that two sources have in unnamed namespaces. A source that
does not compile together with the others is checked alone.
"""
import collections
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / 'build'
FOLDER = BUILD / 'lint'
LINES_OF_BATCH = 60000
# They define again what another source defines: they make batches of their own.
APART = {
    'src/cuboid_mapping/ros/self_filter/robot_description_missing.cpp',
    'test/support/failing_allocation.cpp',
}
OPTIONAL = pathlib.Path('benchmark/peers')  # Needs headers that not every machine has.
OWN = rf'^{re.escape(str(ROOT))}/(include|src|test|benchmark|python)/'
DECLARATION = re.compile(
    r'^(?=\S)(?:\[\[\w+\]\] )?'
    r'(?:(?:struct|class|enum class|enum|using(?! namespace)) (\w+)(?= |;|$)'
    r'|(?!using|return|namespace|template|TEST|INSTANTIATE|#|//|\})[\w:<>,&*\[\] ]+[ &*](\w+)(?=\(|\[|;|\{| =))')


def list_files(*patterns):
    out = subprocess.run(['git', 'ls-files', *patterns], cwd=ROOT, check=True, capture_output=True)
    return [pathlib.Path(line) for line in out.stdout.decode().splitlines()]


def names_in(lines):
    """The declarations of lines in a namespace; clang-format puts that at the beginning of the line."""
    matches = filter(None, map(DECLARATION.match, lines))
    return {match[1] or match[2] for match in matches}


def types_in(text):
    return set(re.findall(r'^(?:struct|class|enum class|using) (\w+)(?= |;|$)', text, re.MULTILINE))


def local_names(text):
    """Names that a source declares in unnamed namespaces, and main."""
    parts = re.findall(r'^namespace \{$(.*?)^\}  // namespace$', text, re.MULTILINE | re.DOTALL)
    mains = {'main'} if re.search(r'^(int main|BENCHMARK_MAIN)\b', text, re.MULTILINE) else set()
    return names_in('\n'.join(parts).splitlines()) | mains


def group_of(source):
    """Sources of a group have one .clang-tidy. Those with headers of rviz stay among themselves: its Node is not ours.

    They are in src/rviz_display and benchmark/display.
    """
    if source.parts[0] == 'test':
        return 'test'
    return 'src-rviz' if source.parts[1] in ('rviz_display', 'display') else 'src'


def make_batches(sources):
    """@return (name, sources) of each, those that take longest first."""
    groups = collections.defaultdict(list)
    for source in sources:
        groups[group_of(source) + ('-apart' if str(source) in APART else '')].append(source)
    batches = {}
    for group, members in groups.items():
        lines = sum((ROOT / member).read_text().count('\n') for member in members)
        count = 1 + lines // LINES_OF_BATCH
        size = -(-len(members) // count)
        for number in range(count):
            batches[f'{group}-{number}'] = members[number * size:(number + 1) * size]
    return sorted(batches.items(), key=lambda batch: -len(batch[1]))


def is_built(source):
    return str(ROOT / source) in (BUILD / 'compile_commands.json').read_text()


def compile_flags():
    """The definitions and include folders of all targets, which agree with each other."""
    flags = {}
    for command in json.loads((BUILD / 'compile_commands.json').read_text()):
        arguments = shlex.split(command['command'])
        for flag, value in zip(arguments, arguments[1:] + ['']):
            if flag == '-isystem':
                flags[flag + value] = None
            elif flag.startswith(('-I', '-D')):
                flags[flag] = None
    return ['-std=c++17', *flags]


def write_batch(file, sources, header_types):
    """One source that includes others: first their headers, then them."""
    includes = {}
    body = []
    taken = set(header_types)
    for number, source in enumerate(sources):
        text = (ROOT / source).read_text()
        for include in re.findall(r'^#include ([<"].*[>"])$', text, re.MULTILINE):
            beside = ROOT / source.parent / include[1:-1]
            includes[f'"{beside.resolve()}"' if beside.is_file() else include] = None
        names = local_names(text)
        renamed = sorted(names & taken)
        taken |= names
        body += [f'#define {name} {name}{number}  // NOLINT' for name in renamed]
        body.append(f'#include "{ROOT / source}"  // NOLINT')
        body += [f'#undef {name}' for name in renamed]
    file.write_text('\n'.join([f'#include {name}' for name in includes] + body) + '\n')


def run_clang_tidy(file, flags):
    end = subprocess.run(['clang-tidy', '--quiet', '--warnings-as-errors=*', '--header-filter=' + OWN,
                          str(file), '--', *flags], cwd=ROOT, capture_output=True, text=True)
    return end.returncode == 0, end.stdout


def lint(name, sources, flags, header_types):
    """@return whether all is well, and what clang-tidy says."""
    together, alone = sources, []
    # In the folder lies a .clang-tidy as beside the sources.
    file = FOLDER / name.split('-')[0] / (name + '.cpp')
    good, text = True, ''
    while together:
        write_batch(file, together, header_types)
        good, text = run_clang_tidy(file, flags)
        broken = {source for source in together
                  if re.search(rf'^{re.escape(str(ROOT / source))}:.*clang-diagnostic-error', text, re.MULTILINE)}
        if not broken:
            break
        alone += sorted(broken)
        together = [source for source in together if source not in broken]
    for source in alone:
        fine, said = run_clang_tidy(source, flags)
        good, text = good and fine, text + said
    together_text = f'{len(together)} sources together, {len(alone)} alone'
    if alone:  # The batch was looked at once more for them.
        together_text += f" ({', '.join(map(str, alone))})"
    return good, f'{name}: {together_text}\n{text}'


def main():
    shutil.rmtree(FOLDER, ignore_errors=True)
    for top in ('src', 'test'):
        (FOLDER / top).mkdir(parents=True)
    shutil.copy(ROOT / '.clang-tidy', FOLDER)
    shutil.copy(ROOT / 'test/.clang-tidy', FOLDER / 'test')
    headers = list_files('include/*.h', 'src/*.h', 'benchmark/*.h', 'python/*.h', 'test/*.h')
    header_types = types_in('\n'.join((ROOT / header).read_text() for header in headers))
    sources = [source for source in list_files('src/*.cpp', 'test/*.cpp', 'benchmark/*.cpp', 'python/*.cpp')
               if source.parent != OPTIONAL or is_built(source)]
    flags = compile_flags()
    print(f'clang-tidy: {len(sources)} sources')
    all_good = True
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [pool.submit(lint, name, members, flags, header_types)
                for name, members in make_batches(sources)]
        for job in concurrent.futures.as_completed(jobs):
            good, text = job.result()
            print(text, flush=True)
            all_good = all_good and good
    return 0 if all_good else 1


if __name__ == '__main__':
    if sys.argv[1:]:
        sys.exit(print(__doc__))
    sys.exit(main())
