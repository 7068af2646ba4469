# SPDX-License-Identifier: BSD-3-Clause
"""Tables of doc/evaluation.md about the paper: from the runs of evaluate_paper."""
import json
import statistics

from benchmark_document import extent, table
from benchmark_runs import FRAMES, finer_sets

REFERENCE_M = 0.2
USUAL_SAMPLES_PER_M = 0.1  # Default of growth/samples_per_m.
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


def strategies_block(runs):
    datasets = runs.datasets()
    variants = [('growth: step cell, starters sampled', {}),
                ('search: largest gain', {'search': 'largest_gain'}), ('search: random', {'search': 'random'}),
                *((f'search: {order}', {'search': order})
                  for order in ('+z -z +x +y -x -y', '-x -y -z +x +y +z', '+x -x +y -y +z -z')),
                ('step: own width', {'step': 'own_width'}), ('step: neighbour', {'step': 'neighbour'}),
                ('starters: end points', {'starters': 'end_points'}),
                ('starters: all changed', {'starters': 'changed'}),
                ('no settling time', {'settle_clouds': 0}), ('static', {'environment': 'static'}),
                ('step neighbour, starters changed', {'step': 'neighbour', 'starters': 'changed'})]
    rows = []
    for title, change in variants:
        row = [title]
        for dataset in datasets:
            octomap = runs.octomap(dataset)
            found = [run for run in (runs.find(dataset, fusion='growth', seed=seed, **change) for seed in (1, 2, 3)) if run]
            row.append(f"{spread([100 * run['cells'] / octomap['cells'] for run in found], '.1f', ' %')}, "
                       f"{spread([run['insert_cpu_s'] for run in found], '.1f', ' s')}" if found else '-')
        rows.append(row)
    for fusion in ('class', 'none'):
        row = [f'fusion {fusion}']
        for dataset in datasets:
            run = runs.find(dataset, fusion=fusion)
            row.append(f"{share(run, runs.octomap(dataset))}, {run['insert_cpu_s']:.1f} s" if run else '-')
        rows.append(row)
    return table(['strategy', *datasets], rows)


READINGS = [('as written', {}), ('(6): cells need not fill it', {'gap_free': False}),
            ('largest face first', {'along': False}), ('(5): by one voxel', {'step': 'cell'}),
            ('by one voxel, largest face first', {'step': 'cell', 'along': False}),
            ('by one voxel, need not fill it', {'step': 'cell', 'gap_free': False})]


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
    """The paper to the letter over resolutions and M, beside OctoMap's run of the same process."""
    branchings = (4, 8, 16, 32, 64)
    rows = []
    for dataset in runs.datasets():
        for resolution in sorted({run['resolution_m'] for run in runs.runs if run['dataset'] == dataset}):
            octomap = runs.octomap(dataset, resolution_m=resolution)
            found = [runs.letter(dataset, resolution_m=resolution, M=branching, samples_per_m=USUAL_SAMPLES_PER_M)
                     for branching in branchings]
            shares = {share(run, octomap) for run in found if run}
            rows.append([dataset, f'{resolution:g} m', f"{octomap['hierarchy_nodes']:,}", ', '.join(sorted(shares))] + [
                f"{run['hierarchy_nodes']:,}; {octomap['insert_cpu_s'] / run['insert_cpu_s']:.2f}; "
                f"{octomap['access_occupied_ms'] / run['access_occupied_ms']:.1f}" if run else '-' for run in found])
    return table(['data set', 'voxels', "OctoMap's nodes", "cells, of OctoMap's", *(f'M = {m}' for m in branchings)], rows)


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
                rows.append([dataset, f'{frames}', f"{octomap['clouds']}", f"{octomap['cells']:,}", share(found.letter(name), octomap),
                             share(found.find(name, fusion='growth'), octomap)])
    return table(['data set', 'one frame of', 'clouds', "OctoMap's cells", 'the paper, to the letter', 'growth'], rows)


def resolutions_block(runs):
    resolutions = sorted({run['resolution_m'] for run in runs.runs})
    rows = []
    for dataset in runs.datasets():
        for fusion in ('growth', 'class'):
            rows.append([dataset, fusion] + [share(runs.find(dataset, fusion=fusion, resolution_m=resolution),
                                                   runs.octomap(dataset, resolution_m=resolution))
                                             for resolution in resolutions])
    return table(['data set', 'fusion', *(f'{resolution:g} m' for resolution in resolutions)], rows)


def speed_block(runs):
    """How many times as fast as OctoMap growth is, by M: insertion, visit of the occupied cells."""
    branchings = (8, 16, 32, 64)
    rows = []
    for dataset in runs.datasets():
        for resolution in sorted({run['resolution_m'] for run in runs.runs if run['dataset'] == dataset}):
            octomap = runs.octomap(dataset, resolution_m=resolution)
            row = [dataset, f'{resolution:g} m']
            for branching in branchings:
                run = runs.find(dataset, fusion='growth', M=branching, resolution_m=resolution)
                row.append(f"{octomap['insert_cpu_s'] / run['insert_cpu_s']:.2f}; "
                           f"{octomap['access_occupied_ms'] / run['access_occupied_ms']:.1f}" if run and octomap else '-')
            rows.append(row)
    return table(['data set', 'voxels', *(f'M = {branching}' for branching in branchings)], rows)


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
        total = len(part['stability'])
        for number in sorted({max(1, total * quarter // 4) for quarter in (1, 2, 3, 4)}):
            unstable, stable, octomap, growth = state(dataset, number)
            percents = (stable / (unstable + stable), unstable / octomap, growth / octomap, (unstable + stable / size) / octomap)
            rows.append([dataset, str(number), f'{100 * percents[0]:.1f} %', f'{octomap:,}',
                         *(f'{100 * percent:.1f} %' for percent in percents[1:])])
    return table(['data set', 'clouds', 'stable voxels', "OctoMap's cells", 'unstable voxels, as share of these',
                  'growth', f'model, {size:.1f} stable voxels a cell'], rows)


def rotation_block(runs):
    rows = []
    for dataset in runs.datasets():
        for fusion in ('growth', 'class'):
            row = [dataset, fusion]
            for angle in (0.0, 10.0, 30.0, 45.0):
                run = runs.find(dataset, fusion=fusion, rotation_deg=angle)
                octomap = runs.octomap(dataset, rotation_deg=angle)
                row.append(f"{run['cells']:,}: {share(run, octomap)}" if run and octomap else '-')
            rows.append(row)
    return table(['data set', 'fusion', '0 degrees', '10', '30', '45'], rows)


def hierarchy_block(runs):
    rows = []
    for dataset in runs.datasets():
        octomap = runs.octomap(dataset)
        row = [dataset, f"{octomap['hierarchy_nodes']:,}"]
        for branching in (2, 4, 8, 16, 32, 64):
            run = runs.find(dataset, fusion='growth', M=branching)
            row.append(f"{run['hierarchy_nodes']:,}; {run['insert_us_per_point']:.1f} us; "
                       f"{run['nodes_of_point_query']:.1f} of {run['height']}" if run else '-')
        rows.append(row)
    return table(['data set', 'OctoMap, inner nodes', *(f'M = {m}' for m in (2, 4, 8, 16, 32, 64))], rows)


def repeats_block(repetitions):
    """Insertion and visit of growth with M = 32, and of the paper to the letter, beside OctoMap's of the same repetition."""
    rows = []
    datasets = dict.fromkeys(dataset for runs in repetitions for dataset in runs.datasets())
    for dataset in datasets:
        resolutions = sorted({run['resolution_m'] for runs in repetitions for run in runs.runs if run['dataset'] == dataset})
        for resolution in resolutions:
            for title, find in (('growth', lambda runs, r: runs.find(dataset, fusion='growth', resolution_m=r)),
                                ('the paper, to the letter', lambda runs, r: runs.letter(dataset, resolution_m=r))):
                pairs = [(runs.octomap(dataset, resolution_m=resolution), find(runs, resolution)) for runs in repetitions]
                pairs = [(octomap, own) for octomap, own in pairs if octomap and own]
                if not pairs:
                    continue
                rows.append([dataset, f'{resolution:g} m', title, str(len(pairs)),
                             spread([octomap['insert_cpu_s'] for octomap, _ in pairs], '.3g', ' s'),
                             spread([own['insert_cpu_s'] for _, own in pairs], '.3g', ' s'),
                             *(spread([octomap[key] / own[key] for octomap, own in pairs], form) for key, form in
                               (('insert_cpu_s', '.2f'), ('access_occupied_ms', '.1f')))])
    return table(['data set', 'voxels', 'map', 'runs', 'OctoMap', 'here', 'insertion: times as fast', 'visit: times as fast'], rows)
