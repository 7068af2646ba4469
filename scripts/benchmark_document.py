# SPDX-License-Identifier: BSD-3-Clause
"""Tables of doc/performance.md, from the reports of compare_maps."""
import json
import math
import pathlib
import re
import statistics
import subprocess
import sys

from benchmark_plots import draw_plots
from benchmark_runs import (HEADLINES, KITTI, OTHER_MAPS, PEERS, RGBD, SHORT_NAMES, Run, fine_voxels, headlines, long_drives, other_maps,
                            sampled_clouds, scaling, spacings)

# ---- Tables -----------------------------------------------------------------------------------


class Reports:
    """The reports of one folder, by the runs that made them."""

    def __init__(self, folder):
        self.by_name = {file.stem: json.loads(file.read_text()) for file in sorted(folder.glob('*.json'))}

    def get(self, run):
        return self.by_name.get(run.name)

    def of(self, runs):
        """The reports that there are."""
        return [self.by_name[run.name] for run in runs if run.name in self.by_name]


def table(head, rows):
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines)


def title_of(report):
    dataset = report['dataset'].split('_every_')[0]
    title = f"{SHORT_NAMES.get(dataset, dataset)}, {report['resolution_m']:g} m"
    limit_m = report['max_range_m']
    if report.get('point_step', 1) > 1:
        title += f", one of {report['point_step']} points"
    return title if limit_m is None else f'{title}, range {limit_m:g} m'


def rate(value):
    """A rate with three digits: 4.12 M."""
    for limit, unit in ((1e6, ' M'), (1e3, ' k')):
        if value >= limit:
            return f'{value / limit:.3g}{unit}'
    return f'{value:.3g}'


def times(value):
    """A ratio with two digits behind the point, one from 10 on, none from 20 on."""
    return f'{value:.0f}' if value >= 20 else f'{value:.1f}' if value >= 10 else f'{value:.2f}'


def extent(values, say):
    """Least and greatest of repetitions, to stand behind their median: ' (1.2 to 1.4)'."""
    return f' ({say(min(values))} to {say(max(values))})' if len(values) > 1 else ''


def per_repetition(report, name, figure):
    """A figure of each repetition of a map."""
    return [figure(figures) for figures in report[name].get('repetitions', [])]


def gain(report, peer, figure):
    """How many times more the peer has of a figure; '-' without the peer."""
    if peer not in report:
        return '-'
    own = figure(report['cuboid_mapping'])
    return times(figure(report[peer]) / own) if own > 0 else '-'


def speed(report, peer, time_of):
    """How many times as fast this map is as a peer; under 2 with the spread of the repetitions. '-' if not offered."""
    def ratio(own, other):
        return time_of(other) / time_of(own)

    if peer not in report or time_of(report['cuboid_mapping']) <= 0:
        return '-'
    value = ratio(report['cuboid_mapping'], report[peer])
    if math.isnan(value):
        return '-'
    pairs = zip(report['cuboid_mapping'].get('repetitions', []), report[peer].get('repetitions', []))
    return times(value) + (extent([ratio(*pair) for pair in pairs], times) if value < 2 else '')


def machine_block(reports):
    machines = {json.dumps(report['machine'], sort_keys=True) for report in reports.by_name.values()}
    lines = []
    for machine in map(json.loads, sorted(machines)):
        lines.append(f"{machine['cpu']}, {machine['cores']} cores; {machine['compiler']}, "
                     f"{machine['build_type']}; commit `{machine['commit']}`.")
    return '\n'.join(lines)


def insertion_block(reports):
    def cpu_s(figures):
        return figures['insert_cpu_s']

    rows = []
    for report in reports.of([*headlines(), *fine_voxels()]):
        own = report['cuboid_mapping']
        peers_s = [f'{cpu_s(report[peer]):.3g} s' if peer in report else '-' for peer in PEERS]
        rows.append([title_of(report), f"{report['clouds']}, {report['points']:,}",
                     f'{cpu_s(own):.3g} s', peers_s[0], speed(report, 'octomap', cpu_s), peers_s[1],
                     speed(report, 'openvdb', cpu_s), f"{own['per_cloud_ms']['p50']:.0f}, {own['per_cloud_ms']['max']:.0f} ms"])
    return table(['data set', 'clouds, points', 'here', 'OctoMap', 'times', 'OpenVDB', 'times', 'a cloud: p50, greatest'], rows)


def variants_block(reports):
    rows = []
    for dataset, resolution in HEADLINES[:3]:
        headline = reports.get(Run(dataset, resolution))
        plain, fused, threads = (
            reports.get(Run(dataset, resolution, peers='none', **options)) for options in
            ({}, {'fuse_every_cloud': True}, {'threads': 2}))
        if not (headline and plain and fused and threads):
            continue
        row = [title_of(headline)]
        for report in (plain, fused):
            own_s = report['cuboid_mapping']['insert_cpu_s']
            row.append(f'{own_s:.3g} s')
            row.append(times(headline['octomap']['insert_cpu_s'] / own_s) if 'octomap' in headline else '-')
        one, two = ((report['cuboid_mapping']['insert_s'],
                     per_repetition(report, 'cuboid_mapping', lambda f: f['insert_s'])) for report in (plain, threads))
        # Processes of their own, so that no repetition of the one belongs to one of the other.
        ratios = [one_s / two_s for one_s in one[1] for two_s in two[1]]
        rows.append([*row, f'{one[0]:.3g} s', f'{two[0]:.3g} s', times(one[0] / two[0]) + extent(ratios, times)])
    return table(['data set', 'divided when read', "times OctoMap's speed", 'divided after every cloud',
                  'times', 'one thread, wall', 'two threads, wall', 'times'], rows)


def memory_block(reports):
    def heap(figures):
        return figures['bytes_heap']

    rows = []
    for report in reports.of(headlines()):
        own = report['cuboid_mapping']
        row = [title_of(report), f"{own['cells']:,}", gain(report, 'octomap', lambda f: f['cells']),
               gain(report, 'openvdb', lambda f: f['cells']), f'{heap(own) / 1e6:.1f} MB']
        for peer in PEERS:
            row += [f'{heap(report[peer]) / 1e6:.1f} MB' if peer in report else '-',
                    gain(report, peer, heap)]
        rows.append([*row, f"{own['bytes_scratch'] / 1e6:.1f} MB"])
    return table(['data set', 'cuboids', "times in OctoMap's leaves", "times in OpenVDB's voxels",
                  'heap here', 'OctoMap', 'times', 'OpenVDB', 'times', 'buffers for insertion'], rows)


QUERIES = [(kind, place) for kind in ('point', 'box', 'ray') for place in ('uniform', 'near_surface')]


def queries_block(reports):
    rows = []
    for report in reports.of(headlines()):
        own = report['cuboid_mapping']
        visit_ms = 1e3 * own['access_occupied_s']
        row = [title_of(report), f'{visit_ms:.3g} ms: ' + ' / '.join(
            speed(report, peer, lambda f: f['access_occupied_s']) for peer in PEERS)]
        for kind in ('point', 'box', 'ray'):
            def per_s(figures, kind=kind):
                return figures[f'{kind}_queries_per_s']['near_surface']

            gains = [speed(report, peer, lambda f, per_s=per_s: 1 / per_s(f)) for peer in PEERS]
            row.append(f"{rate(per_s(own))}: {' / '.join(gains)}")
        rows.append(row)
    return table(['data set', 'visit occupied', 'points', 'boxes', 'rays'], rows)


def agreement_block(reports):
    """Counts of both peers together."""
    rows = []
    for report in reports.of(headlines()):
        agreements = report['agreement'].values()
        answers = [agreement[f'{kind}_queries'][place] for agreement in agreements for kind, place in QUERIES]

        def total(key):
            return f'{sum(agreement[key] for agreement in agreements):.0f}'

        rows.append([title_of(report), f"{max(agreement['voxels'] for agreement in agreements):,.0f}", total('known_mismatch'),
                     total('class_mismatch'), f"{max(agreement['max_log_odds_difference'] for agreement in agreements):.1e}",
                     f"{sum(a['different'] for a in answers)} of {sum(a['compared'] for a in answers):,}"])
    return table(['data set', 'known voxels', 'known to one only', 'different class', 'largest log-odds difference',
                  'answers that differ'], rows)


def other_maps_block(reports):
    """The maps that took part, but for octomap_lazy and ohm_rays, where this one gains most and least."""
    shown = ((KITTI, 0.2), (RGBD, 0.05))
    found = [report for report in reports.of(other_maps()) if (report['dataset'], report['resolution_m']) in shown]

    def cpu_s(figures):
        return figures['insert_cpu_s']

    def per_query(kind):  # None: not offered.
        return lambda figures: 1 / (figures[f'{kind}_queries_per_s']['near_surface'] or math.nan)

    def median_speed(report, name, time_of):
        value = time_of(report[name]) / time_of(report['cuboid_mapping'])
        return '-' if math.isnan(value) else times(value)

    asked = [lambda figures: figures['access_occupied_s'], *map(per_query, ('point', 'box', 'ray'))]
    rows = []
    for report in found:
        for name, title in {'cuboid_mapping': 'here', **OTHER_MAPS}.items():
            if name not in report or name in ('octomap_lazy', 'ohm_rays'):
                continue
            figures = report[name]
            is_own = name == 'cuboid_mapping'
            rows.append([title_of(report), title, f'{cpu_s(figures):.3g} s', '-' if is_own else speed(report, name, cpu_s),
                         '-' if is_own else share_that_differs(report['agreement'][name]), f"{figures['bytes_heap'] / 1e6:.1f} MB",
                         '-' if is_own else '/'.join(median_speed(report, name, time_of) for time_of in asked)])
    return table(['data set', 'map', 'insertion', 'times', 'voxels that differ', 'heap', 'visit/points/boxes/rays'], rows)


def share_that_differs(agreement):
    different = agreement['known_mismatch'] + agreement['class_mismatch']
    return f"{different / agreement['voxels']:.2%}" if different else '0'


def growth_block(reports):
    def thirds(figures):
        return [figures['per_cloud_ms'][f'mean_of_{third}_third'] for third in ('first', 'last')]

    def growth(figures):
        first_ms, last_ms = thirds(figures)
        return last_ms / first_ms

    rows = []
    for report in reports.of(list(long_drives())):
        own = report['cuboid_mapping']
        rows.append([title_of(report), f"{report['clouds']}", *(f'{ms:.1f} ms' for ms in thirds(own)),
                     times(growth(own)) + extent(per_repetition(report, 'cuboid_mapping', growth), times)])
    return table(['data set', 'clouds of all laps', 'first third', 'last third', 'times'], rows)


def exponent(points):
    """a of y = c x^a with its standard error, by least squares on logarithms; '-' for figures that are not there."""
    if any(not y or math.isnan(y) for _, y in points) or len(points) < 2:
        return '-'
    logs = [(math.log(x), math.log(y)) for x, y in points]
    mean_x, mean_y = (sum(values) / len(logs) for values in zip(*logs))
    spread = sum((x - mean_x) ** 2 for x, _ in logs)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in logs) / spread
    left = sum((y - mean_y - slope * (x - mean_x)) ** 2 for x, y in logs)
    error = f' ± {math.sqrt(left / (len(logs) - 2) / spread):.2f}' if len(logs) > 2 else ''
    return f'{slope:.2f}{error}'


VARIED = {'points of a cloud': lambda r: r['points'] / r['clouds'], '1 / edge of a voxel': lambda r: 1 / r['resolution_m'],
          'size of the map': lambda r: r['laps']}
SCALED = {'insertion of a cloud, CPU': lambda r, f: f['insert_cpu_s'] / r['clouds'], 'heap': lambda _, f: f['bytes_heap'],
          'visit of the occupied': lambda _, f: f['access_occupied_s'],
          'a point': lambda _, f: 1 / (f['point_queries_per_s']['near_surface'] or math.nan)}


def scaling_block(reports):
    """Exponents of each figure, of this map and of OctoMap, over what is varied."""
    rows = []
    for varied, runs in scaling(is_large=True):
        found = sorted(reports.of(runs), key=VARIED[varied])
        if len(found) < 2:
            continue
        names = [name for name in ('cuboid_mapping', 'octomap') if all(name in report for report in found)]
        ends = [f'{VARIED[varied](report):,.3g}' for report in (found[0], found[-1])]
        data = title_of(found[-1]) if varied != '1 / edge of a voxel' else SHORT_NAMES[found[-1]['dataset']]
        rows.append([varied, data, f'{ends[0]} to {ends[1]}, {len(found)}',
                     *(' / '.join(exponent([(VARIED[varied](report), figure(report, report[name])) for report in found]).split(' ±')[0]
                                for name in names) for figure in SCALED.values())])
    return table(['varied', 'data set', 'from, to, runs', *SCALED], rows)


def median_interval(values):
    """The order statistics that have the median between them with a probability of 0.95 or more, for any distribution.
    None: these are too few values."""
    count = len(values)
    outside, left_out = 2 / 2 ** count, 0  # Probability; values at each end.
    if outside > 0.05:
        return None
    while (further := outside + 2 * math.comb(count, left_out + 1) / 2 ** count) <= 0.05:
        outside, left_out = further, left_out + 1
    ordered = sorted(values)
    return ordered[left_out], ordered[-1 - left_out]


def median_with_interval(values):
    interval = median_interval(values)
    text = times(statistics.median(values))
    return f'{text} ({times(interval[0])} to {times(interval[1])})' if interval else text


RATIOS = {'insertion': lambda f: f['insert_cpu_s'], 'heap': lambda f: f['bytes_heap'],
          **{f'{kinds} at surfaces': lambda f, kind=kind: 1 / f[f'{kind}_queries_per_s']['near_surface']
             for kind, kinds in (('point', 'points'), ('ray', 'rays'))}}


def processes_block(reports):
    """Ratios of each process, over OctoMap with the interval / over OpenVDB."""
    rows = []
    for headline in HEADLINES:
        found = [report for report in reports.by_name.values()
                 if report.get('shuffle') and (report['dataset'], report['resolution_m']) == headline]
        of_peers = [[report for report in found if peer in report] for peer in PEERS]
        if found:
            rows.append([title_of(found[0]), ' / '.join(f'{len(of_peer)}' for of_peer in of_peers if of_peer), *(
                ' / '.join(say([figure(report[peer]) / figure(report['cuboid_mapping']) for report in of_peer])
                           for say, peer, of_peer in zip((median_with_interval, lambda ratios: times(statistics.median(ratios))), PEERS, of_peers)
                           if of_peer) for figure in RATIOS.values())])
    return table(['data set', 'processes', *RATIOS], rows)


def samples_block(reports):
    rows = []
    for report in reports.of(sampled_clouds()):
        samples = report['cuboid_mapping']['cloud_samples']
        ms = samples['cpu_ms']
        rows.append([title_of(report), f"{samples['count']:,}", *(f'{ms[key]:.3g} ms' for key in ('p50', 'p99', 'p99_9', 'max'))])
    return table(['data set', 'clouds timed', 'CPU: p50', 'p99', 'p99.9', 'greatest'], rows)


def spacing_block(reports):
    rows = []
    for frames, run in spacings():
        if not (report := reports.get(run)):
            continue
        rows.append([title_of(report), f'{frames}', f"{report['clouds']}",
                     *(gain(report, 'octomap', figure) for figure in (lambda f: f['cells'], lambda f: f['bytes_heap'], lambda f: f['insert_cpu_s']))])
    return table(['data set', 'one frame of', 'clouds', "times in OctoMap's cells", 'heap', 'insertion'], rows)


def nodes_block():
    """Of the kept runs of nodes: `campaign/beside_octomap_server --json doc/performance/octomap_server.json` makes them."""
    root = pathlib.Path(__file__).resolve().parent.parent
    return subprocess.run([sys.executable, root / 'campaign/beside_octomap_server', '--read', root / 'doc/performance/octomap_server.json'],
                          check=True, capture_output=True, text=True).stdout.strip()


# ---- The document -----------------------------------------------------------------------------


def write_document(reports, document):
    blocks = {'machine': machine_block, 'insertion': insertion_block, 'variants': variants_block,
              'memory': memory_block, 'queries': queries_block, 'agreement': agreement_block,
              'growth': growth_block, 'peers': other_maps_block, 'scaling': scaling_block, 'processes': processes_block,
              'samples': samples_block, 'spacing': spacing_block}
    texts = {name: make(reports) for name, make in blocks.items()}
    texts['nodes'] = nodes_block()
    texts.update(draw_plots(reports, document.parent / document.stem))
    fill_blocks(document, texts)


def fill_blocks(document, texts):
    """Fills in the text between the marks of a document, and of its page in the folder tables."""
    def fill(match):
        name = match.group(1)
        if name not in texts:
            sys.exit(f'{document}: there is no block {name}, only {", ".join(texts)}')
        return f'<!-- benchmark:begin {name} -->\n{texts[name]}\n<!-- benchmark:end -->'

    for page in (document, document.parent / 'tables' / document.name):
        if page.exists():
            page.write_text(re.sub(r'<!-- benchmark:begin (\w+) -->.*?<!-- benchmark:end -->', fill, page.read_text(),
                                   flags=re.DOTALL))
        texts = {name: text.replace('](', '](../') for name, text in texts.items()}
