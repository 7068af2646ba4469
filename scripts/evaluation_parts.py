# SPDX-License-Identifier: BSD-3-Clause
"""Tables and plots of doc/evaluation.md about parts of the map, corridors and moving objects."""
import statistics

from benchmark_document import table
from benchmark_plots import Plot

INSERTIONS = [('OctoMap, `insertPointCloud`', 'octomap'), ("OctoMap's tree, this ray walk", 'octomap_with_ray_walk'),
              ('this ray walk alone', 'ray_walk'), ('voxels, no cuboids', 'voxels_without_tree'),
              ('voxels, and cuboids once at the end', 'fused_at_the_end'),
              ('voxels, and cuboids after every cloud', 'fused_after_every_cloud')]


def ablations_block(ablations):
    rows = [[title, *(f"{part['insertion'][key]['median_s']:.3g} s" for part in ablations.values())] for title, key in INSERTIONS]
    for title, key in (('points a second', 'points_per_s'), ('boxes of 2 m', 'boxes_per_s'),
                       ('rays of 30 m', 'rays_per_s')):
        for name, own in (('OctoMap', 'octomap'), ('masks', 'cuboid_mapping'), ('R-tree alone', 'tree_only')):
            rows.append([f'{title}: {name}', *(f"{part['queries'][own][key]:,.0f}" for part in ablations.values())])
    for title, key in (("OctoMap's iterator", 'octomap_iterator_ms'),
                       ('OctoMap, free subtrees skipped', 'octomap_skipping_ms'), ('R-tree', 'rtree_ms')):
        rows.append([f'visit of occupied cells: {title}',
                     *(f"{part['visit_occupied'][key]:.3g} ms" for part in ablations.values())])
    return table(['', *ablations], rows)


SHOWN = ('kitti_0005_city', 'sim_fr079')  # Outdoors and indoors, where a table of all sets says no more.
INDEXES = ('rtree', 'brick_hash', 'list')


def indexes_block(reports):
    """CPU time of each query in the R-tree, and how many times that the hash and the list take: a set outdoors, and one indoors."""
    reports = {dataset: reports[dataset] for dataset in SHOWN if dataset in reports}
    rows = []
    titles = [kind['queries'] for kind in next(iter(reports.values()))['queries']] if reports else []
    for number, title in enumerate(titles):
        row = [title]
        for report in reports.values():
            rtree, *others = (report['queries'][number][f'{index}_us'] for index in INDEXES)
            row += [f'{rtree:.3g} us', *(f'{other / rtree:.2g}' if other / rtree < 99.5 else f'{other / rtree:,.0f}' for other in others)]
        rows.append(row)
    for title, figure in (('all bricks inserted', lambda report, index: (report['building'][f'{index}_ms'], 'ms')),
                          ('memory', lambda report, index: (report['bytes'][index] / 1e3, 'kB'))):
        row = [title]
        for report in reports.values():
            rtree, *others = (figure(report, index) for index in INDEXES)
            row += [f'{rtree[0]:.3g} {rtree[1]}', *(f'{other / rtree[0]:.2g}' for other, _ in others)]
        rows.append(row)
    heads = [head for dataset, report in reports.items()
             for head in (f"{dataset}, {report['resolution_m']:g} m: R-tree", 'hash', 'list')]
    return table(['', *heads], rows)


def boxes_block(ablations):
    rows = []
    for dataset, part in ablations.items():
        boxes, sample = part['boxes'], part['boxes']['sample']
        rows.append([dataset, f"{boxes['cuboids']:,}",
                     f"{boxes['joined_across_bricks']:,} ({100 * boxes['joined_across_bricks'] / boxes['cuboids']:.1f} %)",
                     f"{sample['bricks']:,}", f"{sample['cuboids']:,}",
                     f"{sample['best_of_orders']:,} ({100 * sample['best_of_orders'] / sample['cuboids']:.1f} %)",
                     f"{sample['lower_bound']:,} ({100 * sample['lower_bound'] / sample['cuboids']:.1f} %)"])
    return table(['data set', 'cuboids', 'joined across bricks', 'bricks of the sample', 'cuboids in them',
                  'best of 48 orders', 'at least'], rows)


def rate_block(rates, folder):
    """A plot of each data set, and the row of each map at the finest resolution."""
    lines, rows = [], []
    for dataset, report in rates.items():
        plot = Plot(folder / f'{dataset}_rate.svg', 'bits lost, of each voxel known at the finest resolution', 'memory [bytes]', is_measured=True)
        for name in dict.fromkeys(row['map'] for row in report['rows']):
            plot.add(name, [(row['lost_bits'], row['memory_bytes']) for row in report['rows'] if row['map'] == name])
        plot.draw()
        lines.append(f'![{dataset}]({folder.name}/{plot.file.name})')
        finest = report['finest_m']
        for row in report['rows']:
            if row['resolution_m'] == finest and row['map'] != 'openvdb':
                rows.append([f'{dataset}, {finest:g} m', row['map'], f"{row['cells']:,}",
                             f"{row['memory_bytes'] / 1e6:.3g} MB", f"{row['lost_bits']:.3f}"])
    return '\n'.join([table(['data set', 'map', 'cells', 'memory, its own figure', 'bits lost a voxel'], rows),
                      '', *lines])


def passing_title(run):
    if run['map'] == 'octomap':
        return 'OctoMap'
    settling = f", settle_clouds {run['settle_clouds']}" if run['fusion'] == 'growth' and \
        run['environment'] == 'dynamic' else ''
    return f"{run['fusion']}, {run['environment']}{settling}"


def passing_rows(report):
    """A row for every tenth cloud of each drive and map."""
    return [{'map': passing_title(run), 'seed': run['seed'], 'left_voxels': run['left_voxels'],
             'remaining_voxels': run['remaining_voxels'], **step}
            for run in report['passing_objects'] for step in run['over_time']]


def passing_block(report, folder):
    by_title = {}
    for run in report['passing_objects']:
        by_title.setdefault(passing_title(run), []).append(run)

    def figures(runs, figure):
        return f'{statistics.median(map(figure, runs)):,.0f}'

    def at(clouds, key):
        return lambda run: next(step[key] for step in run['over_time'] if step['clouds'] == clouds)

    rows = []
    for title, runs in by_title.items():
        if title in ('growth, dynamic, settle_clouds 3', 'growth, dynamic, settle_clouds 30'):
            continue
        is_octomap = title == 'OctoMap'
        rows.append([title, figures(runs, lambda run: run['left_voxels']), figures(runs, lambda run: run['remaining_voxels']),
                     figures(runs, at(300, 'cells')),
                     '-' if is_octomap else figures(runs, at(300, 'splits')),
                     '-' if is_octomap else figures(runs, at(300, 'fused_again')),
                     f"{statistics.median(sum(step['cpu_s'] for step in run['over_time']) for run in runs):.1f} s"])
    lines = [table(['map', 'voxels when the walker leaves', '50 clouds later', 'cells then',
                    'cuboids split', 'voxels fused again', 'CPU'], rows), '']
    for name, label, figure in (('cells', 'cells', lambda step, _: step['cells']),
                                ('splits', 'cuboids split, in ten clouds',
                                 lambda step, last: step['splits'] - last['splits'] if 'splits' in step else None),
                                ('cpu', 'CPU ms a cloud', lambda step, _: 100 * step['cpu_s'])):
        plot = Plot(folder / f'passing_{name}.svg', 'clouds', label, is_log=False, is_measured=True)
        for title, runs in by_title.items():
            steps = [{'splits': 0}, *runs[0]['over_time']]
            points = [(step['clouds'], figure(step, last)) for last, step in zip(steps, steps[1:])]
            plot.add(title, [point for point in points if point[1] is not None])
        plot.draw()
        lines.append(f'![{label}]({folder.name}/{plot.file.name})')
    return '\n'.join(lines)


WAYS = {'cuboid_mapping': 'corridor of this map', 'octomap': "OctoMap's leaves", 'voxels': 'voxel by voxel'}


def corridor_rows(reports):
    """A row for each pair and map; figures of the second plan have the prefix again_."""
    rows = []
    for dataset, report in reports.items():
        for row in report['rows']:
            again = {f'again_{key}': value for key, value in row.get('again', {}).items()}
            rows.append({'dataset': dataset, 'resolution_m': report['resolution_m'], 'commit': report['commit'],
                         **{key: value for key, value in row.items() if key != 'again'}, **again})
    return rows


def corridors_block(reports):
    """Medians over pairs: outdoors and indoors."""
    rows = []
    for dataset, report in ((dataset, reports[dataset]) for dataset in SHOWN if dataset in reports):
        shortest = {row['pair']: row['length_m'] for row in report['rows'] if row['map'] == 'voxels' and row['found']}
        for name, title in WAYS.items():
            of_map = [row for row in report['rows'] if row['map'] == name]
            found = [row for row in of_map if row['found'] and shortest[row['pair']] > 0]
            changed = [row for row in found if 'again' in row]

            def median(figure):
                return statistics.median(map(figure, found))
            rows.append([f"{dataset}, {report['resolution_m']:g} m", title,
                         f"{median(lambda row: row['boxes']):.0f}", f"{median(lambda row: row['volume_m3']):.3g}",
                         f"{median(lambda row: row['length_m'] / shortest[row['pair']]):.3f}", f"{median(lambda row: row['plan_ms']):.3g}",
                         f"{sum(row['is_corridor_hit'] for row in changed)}, {sum(row['is_path_hit'] for row in changed)} of {len(changed)}"])
    return table(['data set', 'way', 'boxes', 'volume [m3]', 'length, of voxel by voxel', 'plan [CPU ms]', 'corridors, paths hit'], rows)
