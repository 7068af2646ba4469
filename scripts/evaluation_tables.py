# SPDX-License-Identifier: BSD-3-Clause
"""Tables of doc/evaluation.md about the paper: from the runs of evaluate_paper."""
import json
import statistics

from benchmark_document import extent, table
from benchmark_runs import FRAMES, finer_sets

REFERENCE_M = 0.2
USUAL_SAMPLES_PER_M = 0.1  # Default of growth.sampling.per_m.
FITTED = 'muehlburger_tor_standing'  # The one data set that the model of stable voxels is fitted to.


class Runs:
    """Runs of evaluate_paper."""

    def __init__(self, runs):
        self.runs = runs

    @classmethod
    def read(cls, folder):
        """The runs of a folder, by data set and name."""
        runs = []
        for file in sorted(folder.glob('*/runs/*.json')):
            runs.append({**json.loads(file.read_text()), 'dataset': file.parent.parent.name})
        return cls(runs)

    def find(self, dataset, **wanted):
        """The only run with these figures, or nothing."""
        wanted = {'rotation_deg': 0.0, 'resolution_m': REFERENCE_M, **wanted}
        if wanted.get('map') != 'octomap':
            wanted = {'M': 32, 'environment': 'dynamic', **wanted}
        if wanted.get('fusion') == 'growth':
            wanted = {'step': 'cell', 'search': 'paper', 'starters': 'sampled', 'settle_clouds': 10, 'seed': 1, **wanted}
        found = [run for run in self.runs if run['dataset'] == dataset and
                 all(run.get(key, 1 if key == 'seed' else None) == value for key, value in wanted.items())]
        return found[0] if len(found) == 1 else None

    def octomap(self, dataset, **wanted):
        return self.find(dataset, map='octomap', **wanted)

    def letter(self, dataset, **wanted):
        """The paper's grid: the first reading of doc/evaluation.md, or another one."""
        wanted = {'step': 'own_width', 'gap_free': True, 'along': True, **wanted}
        return self.find(dataset, map='paper', environment='static', **wanted)

    def datasets(self):
        return list(dict.fromkeys(run['dataset'] for run in self.runs))


def share(run, octomap):
    return f"{100 * run['cells'] / octomap['cells']:.1f} %" if run and octomap else '-'


def spread(values, form, unit=''):
    """Median (least to greatest), or the only value. @param form  As of format()."""
    return f'{statistics.median(values):{form}}{unit}' + extent(values, f'{{:{form}}}'.format)


def summary_block(runs):
    rows = []
    for dataset in runs.datasets():
        octomap = runs.octomap(dataset)
        for title, run in (('OctoMap, pruned', octomap),
                           ('the paper, to the letter', runs.letter(dataset)),
                           ('growth', runs.find(dataset, fusion='growth')),
                           ('growth, static', runs.find(dataset, fusion='growth', environment='static')),
                           ('growth, step neighbour, starters changed',
                            runs.find(dataset, fusion='growth', step='neighbour', starters='changed')),
                           ('class', runs.find(dataset, fusion='class'))):
            if run is None:
                continue
            agreement = '-'
            if 'known_mismatch' in run:
                agreement = (f"{run['known_mismatch'] + run['class_mismatch']:.0f} of {run['voxels']:,.0f}")
            rows.append([dataset, title, f"{run['cells']:,}", share(run, octomap),
                         f"{run['hierarchy_nodes']:,}", f"{run['insert_cpu_s']:.2f} s",
                         f"{run['access_occupied_ms']:.2f} ms", agreement])
    return table(['data set', 'map', 'cells', "share of OctoMap's", 'nodes of the hierarchy', 'insertion, CPU',
                  'visit of occupied cells', 'voxels that differ from OctoMap'], rows)


def fewer(run, octomap):
    percent = 100 - 100 * run['cells'] / octomap['cells']
    return f"{abs(percent):.0f} % {'fewer' if percent > 0 else 'more'}"


def method_block(runs):
    """What the default brings beside the paper: a table of doc/method.md."""
    places = {'standing lidar': 'muehlburger_tor_standing', 'driving car': 'kitti_0005_city'}
    octomap = [runs.octomap(dataset) for dataset in places.values()]
    methods = [[find(dataset) for dataset in places.values()] for find in (
        runs.letter, lambda dataset: runs.find(dataset, fusion='growth', environment='static'), lambda dataset: runs.find(dataset, fusion='class'))]

    def row(title, paper, figures):
        *others, default = figures
        return [title, paper, *others, f'**{default}**']

    def both(figure):
        """A figure of each method, for both data sets."""
        return [' and '.join(f'{value:.{0 if value >= 10 else 1}f}' for value in map(figure, own, octomap)) for own in methods]

    rows = [['cells, beside the pruned OctoMap: a campus', '28.5 % fewer', '', '', '']]
    for number, place in enumerate(places):
        rows.append(row(f'cells: {place}', '', [fewer(own[number], octomap[number]) for own in methods]))
    rows.append(row("nodes of the tree, share of OctoMap's: standing, driving", 'fewer', [f'{text} %' for text in both(
        lambda run, their: 100 * run['hierarchy_nodes'] / their['hierarchy_nodes'])]))
    for title, paper, key in (('insertion, times as fast as OctoMap: standing, driving', 'slower', 'insert_cpu_s'),
                              ('visit of occupied cells, times as fast', 'faster', 'access_occupied_ms')):
        rows.append(row(title, paper, both(lambda run, their, key=key: their[key] / run[key])))
    return table(['', 'paper', 'to the letter', '`growth`', '`class`'], rows)


def strategies_block(runs):
    datasets = runs.datasets()
    variants = [('growth: step cell, starters sampled', {}),
                ('search: largest gain', {'search': 'largest_gain'}),
                ('step: own width', {'step': 'own_width'}), ('step: neighbour', {'step': 'neighbour'}),
                ('starters: end points', {'starters': 'end_points'}),
                ('starters: all changed', {'starters': 'changed'}),
                ('static', {'environment': 'static'}),
                ('step neighbour, starters changed', {'step': 'neighbour', 'starters': 'changed'})]
    rows = []
    for title, change in variants:
        row = [title]
        for dataset in datasets:
            octomap = runs.octomap(dataset)
            found = [run for run in (runs.find(dataset, fusion='growth', seed=seed, **change) for seed in (1, 2, 3)) if run]
            row.append(f"{statistics.median(100 * run['cells'] / octomap['cells'] for run in found):.1f} %" if found else '-')
        rows.append(row)
    for fusion in ('class', 'none'):
        rows.append([f'fusion {fusion}', *(share(runs.find(dataset, fusion=fusion), runs.octomap(dataset)) for dataset in datasets)])
    return table(['strategy', *datasets], rows)


READINGS = [('as written', {}), ('(6): cells need not fill it', {'gap_free': False}),
            ('largest face first', {'along': False}), ('(5): by one voxel', {'step': 'cell'})]


def readings_block(runs):
    rows = []
    for title, reading in READINGS:
        row = [title]
        for dataset in runs.datasets():
            run, octomap = runs.letter(dataset, **reading), runs.octomap(dataset)
            if run is None:
                row.append('-')
                continue
            unseen = run['voxels'] / octomap['voxels'] - 1
            row.append(f"{share(run, octomap)}, {run['insert_cpu_s']:.1f} s"
                       + (f', {100 * unseen:.2f} % unknown' if unseen else ''))
        rows.append(row)
    return table(['reading', *runs.datasets()], rows)


def letter_block(runs):
    """The paper to the letter over M, beside OctoMap's run of the same process."""
    branchings = (8, 32, 64)
    rows = []
    for dataset in runs.datasets():
        octomap = runs.octomap(dataset)
        found = [runs.letter(dataset, M=branching, samples_per_m=USUAL_SAMPLES_PER_M) for branching in branchings]
        shares = {share(run, octomap) for run in found if run}
        rows.append([dataset, ', '.join(sorted(shares))] + [
            f"{run['hierarchy_nodes'] / octomap['hierarchy_nodes']:.2f}; {octomap['insert_cpu_s'] / run['insert_cpu_s']:.2f}; "
            f"{octomap['access_occupied_ms'] / run['access_occupied_ms']:.1f}" if run else '-' for run in found])
    return table(['data set', "cells, of OctoMap's", *(f'M = {m}' for m in branchings)], rows)


def starters_block(runs):
    """The paper to the letter over the density of the cells drawn for T."""
    densities = sorted({run['samples_per_m'] for run in runs.runs if 'samples_per_m' in run})
    rows = []
    for dataset in runs.datasets():
        octomap = runs.octomap(dataset)
        found = [runs.letter(dataset, samples_per_m=density) for density in densities]
        if octomap and sum(run is not None for run in found) > 1:
            rows.append([dataset] + [f"{share(run, octomap)}, {run['insert_cpu_s'] / octomap['insert_cpu_s']:.2f}" if run else '-'
                                     for run in found])
    return table(['data set', *(f'{density:g} a metre' for density in densities)], rows)


def spacing_block(finer, spacings):
    """Cells of the same recording with more and with fewer of its frames.

    @param finer     Runs of the sets with more frames.
    @param spacings  Runs of the data sets, by how many scans one is taken of.
    """
    rows = []
    for dataset in dict.fromkeys(dataset for thinned in list(spacings.values())[1:] for dataset in thinned.datasets()):
        sets = [(frames, name, finer) for frames, name in finer_sets(dataset)]
        sets += [(every * FRAMES[dataset], dataset, thinned) for every, thinned in spacings.items()]
        for frames, name, found in sets:
            octomap = found.octomap(name)
            if octomap:
                rows.append([dataset, f'{frames}', f"{octomap['clouds']}", share(found.letter(name), octomap),
                             share(found.find(name, fusion='growth'), octomap)])
    return table(['data set', 'one frame of', 'clouds', 'the paper, to the letter', 'growth'], rows)


def resolutions_block(runs):
    resolutions = sorted({run['resolution_m'] for run in runs.runs})
    rows = []
    for dataset in runs.datasets():
        for fusion in ('growth', 'class'):
            rows.append([dataset, fusion] + [share(runs.find(dataset, fusion=fusion, resolution_m=resolution),
                                                   runs.octomap(dataset, resolution_m=resolution))
                                             for resolution in resolutions])
    return table(['data set', 'fusion', *(f'{resolution:g} m' for resolution in resolutions)], rows)


def stability_block(runs, ablations):
    """Cells of growth, predicted from the stable voxels: all others are single cells, and of these SIZE form one."""
    def state(dataset, number):
        stability = ablations[dataset]['stability'][number - 1]
        cells = [run['cells_over_time'][number - 1] for run in (runs.octomap(dataset), runs.find(dataset, fusion='growth'))]
        return stability['voxels'] - stability['stable'], stability['stable'], *cells

    unstable, stable, _, growth = state(FITTED, len(ablations[FITTED]['stability']))
    size = stable / (growth - unstable)
    rows = []
    for dataset, part in ablations.items():
        unstable, stable, octomap, growth = state(dataset, len(part['stability']))
        percents = (stable / (unstable + stable), unstable / octomap, growth / octomap, (unstable + stable / size) / octomap)
        rows.append([dataset, *(f'{100 * percent:.1f} %' for percent in percents)])
    return table(['data set', 'stable voxels', 'unstable voxels, as share of OctoMap\'s cells',
                  'growth', f'model, {size:.1f} stable voxels a cell'], rows)


def rotation_block(runs):
    angles = (0.0, 45.0)
    rows = []
    for dataset in runs.datasets():
        for fusion in ('growth', 'class'):
            rows.append([dataset, fusion, *(share(runs.find(dataset, fusion=fusion, rotation_deg=angle), runs.octomap(dataset, rotation_deg=angle))
                                            for angle in angles)])
    return table(['data set', 'fusion', '0 degrees', '45'], rows)


def hierarchy_block(runs):
    branchings = (8, 16, 32, 64)
    rows = []
    for dataset in runs.datasets():
        nodes = [run['hierarchy_nodes'] if run else None for run in (
            runs.octomap(dataset), *(runs.find(dataset, fusion='growth', M=branching) for branching in branchings))]
        rows.append([dataset, *(f'{number:,}' if number else '-' for number in nodes)])
    return table(['data set', 'OctoMap, inner nodes', *(f'M = {m}' for m in branchings)], rows)


def repeats_block(repetitions):
    """Insertion and visit of growth with M = 32, and of the paper to the letter, beside OctoMap's of the same repetition."""
    rows = []
    datasets = dict.fromkeys(dataset for runs in repetitions for dataset in runs.datasets())
    for dataset in datasets:
        for title, find in (('growth', lambda runs: runs.find(dataset, fusion='growth')), ('the paper, to the letter', lambda runs: runs.letter(dataset))):
            pairs = [(runs.octomap(dataset), find(runs)) for runs in repetitions]
            pairs = [(octomap, own) for octomap, own in pairs if octomap and own]
            if pairs:
                rows.append([dataset, title, *(spread([octomap[key] / own[key] for octomap, own in pairs], form) for key, form in
                                               (('insert_cpu_s', '.2f'), ('access_occupied_ms', '.1f')))])
    return table(['data set', 'map', 'insertion: times as fast', 'visit: times as fast'], rows)
