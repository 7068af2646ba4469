# SPDX-License-Identifier: BSD-3-Clause
"""Runs of scripts/benchmark: data sets, resolutions and options of compare_maps."""
import random

SHORT_NAMES = {'kitti_0005_city': 'KITTI', 'muehlburger_tor_standing': 'Tor', 'sim_fr079': 'fr079', 'rgbd_7scenes': '7-Scenes'}
PEERS = {'octomap': 'OctoMap', 'openvdb': 'OpenVDB'}
OTHER_MAPS = {'octomap': 'OctoMap', 'octomap_lazy': 'OctoMap, lazy', 'octomap_discrete': 'OctoMap, discretized',
              'openvdb': 'OpenVDB', 'bonxai': 'Bonxai, grid', 'bonxai_map': 'Bonxai, own rays', 'ufomap': 'UFOMap', 'wavemap': 'wavemap, our voxels',
              'ohm': 'ohm, our voxels', 'ohm_rays': 'ohm, own rays', 'mrpt': 'mrpt, our voxels', 'dmap': 'D-Map'}
KITTI, TOR, FR079, RGBD = SHORT_NAMES
# One frame of so many of the recording is a scan of the data set; and sets with more of its frames, made by scripts/data_set.
FRAMES = {KITTI: 6, TOR: 2, FR079: 1, RGBD: 160}
FINER = {KITTI: (1, 2, 3), TOR: (1,), FR079: (), RGBD: (5, 20)}

# (data set, resolution).
HEADLINES = [(KITTI, 0.2), (TOR, 0.2), (FR079, 0.05), (FR079, 0.1), (RGBD, 0.05), (RGBD, 0.02)]
REPETITIONS = 3
PROCESSES = 10   # For intervals of the headlines' ratios.


class Run:
    """One run of compare_maps; its name says its options and is that of its report."""

    def __init__(self, dataset, resolution, repeat=REPETITIONS, **options):
        self.dataset = dataset
        self.resolution = resolution
        self.repeat = repeat  # Not in the name: reports of more repetitions serve as well.
        self.options = options

    @property
    def name(self):
        parts = [self.dataset, f'resolution_{self.resolution:g}']
        for key, value in sorted(self.options.items()):
            parts.append(key if value is True else f'{key}_{value}')
        return '-'.join(parts)

    def arguments(self):
        arguments = ['--resolution', f'{self.resolution:g}', '--repeat', str(self.repeat)]
        for key, value in sorted(self.options.items()):
            arguments.append('--' + key.replace('_', '-'))
            if value is not True:
                arguments.append(str(value))
        return arguments


def headlines():
    return [Run(dataset, resolution) for dataset, resolution in HEADLINES]


def other_maps():
    return [Run(dataset, resolution, peers='all') for dataset, resolution in HEADLINES]


def fine_voxels():
    """Outdoors, where OctoMap would need minutes."""
    yield Run(KITTI, 0.1, peers='openvdb')
    yield Run(KITTI, 0.05, peers='openvdb', max_range=30)


def variants():
    """Of the headlines outdoors and in the corridor, compared with those."""
    for dataset, resolution in HEADLINES[:3]:
        yield Run(dataset, resolution, peers='none')
        yield Run(dataset, resolution, peers='none', fuse_every_cloud=True)
        yield Run(dataset, resolution, peers='none', threads=2)


def resolution_sweep(dataset):
    """A few clouds of KITTI, since cost grows eightfold from one resolution to the next at worst."""
    clouds = {'clouds': 6} if dataset == KITTI else {}
    for resolution in (0.4, 0.2, 0.1, 0.05):
        is_long = dataset == KITTI and resolution < 0.1  # Minutes for OctoMap.
        peers = {'peers': 'openvdb'} if is_long else {}
        yield Run(dataset, resolution, 1 if is_long else REPETITIONS, **clouds, **peers)


def range_sweep():
    for max_range in (5, 10, 20, 40, 80):
        yield Run(KITTI, 0.2, 1, clouds=6, max_range=max_range)


def cloud_sweep():
    for clouds in (11, 22, 44):
        yield Run(TOR, 0.2, 1, clouds=clouds)
    yield Run(TOR, 0.2)


def long_drives():
    """Many times as long as the headlines, in surroundings of the same form."""
    yield Run(KITTI, 0.2, laps=3, peers='none')
    yield Run(KITTI, 0.2, laps=9, peers='none')
    yield Run(TOR, 0.2, clouds=22, laps=3, peers='none')
    yield Run(FR079, 0.05, laps=3, peers='none')


def branching_sweep():
    for branching in (4, 8, 16, 24, 32, 48, 64):
        yield Run(KITTI, 0.2, 1, clouds=13, branching=branching, peers='none')


def process_runs(count=PROCESSES):
    """Headlines in so many processes each, with one repetition. Each headline runs once before any runs again; the order of
    headlines, and that of the maps in a process, are random, and the same in every call."""
    generator = random.Random(41)
    runs = []
    for number in range(1, count + 1):
        runs += generator.sample([Run(dataset, resolution, 1, shuffle=number) for dataset, resolution in HEADLINES], len(HEADLINES))
    return runs


def sampled_clouds():
    """10^4 clouds each, divided after every cloud, as in the node; the last as a sparse lidar sees it."""
    options = {'peers': 'none', 'fuse_every_cloud': True, 'cloud_samples': 10000}
    for dataset, resolution in HEADLINES:
        yield Run(dataset, resolution, 1, **options)
    yield Run(KITTI, 0.2, 1, point_step=4, **options)


def finer_sets(dataset):
    """Sets with more frames of a recording: (one frame of so many, name)."""
    return [(frames, f'{dataset}_every_{frames}') for frames in FINER[dataset]]


def spacings():
    """Of a headline of each moving sensor, with more and with fewer of its frames: (one frame of so many, run)."""
    for dataset, resolution in (HEADLINES[0], HEADLINES[4]):
        for frames, name in finer_sets(dataset):
            yield frames, Run(name, resolution, 1)
        for every in (1, 2, 4) if dataset != RGBD else (1,):
            yield every * FRAMES[dataset], Run(dataset, resolution, 1, every=every)


def scaling(is_large=False):
    """Runs of each row of the table of scaling: (varied, runs). The large ones take hours, and up to 10^9 voxels."""
    steps, laps = [16, 8, 4, 2, 1], [1, 2, 4, 8]
    yield 'points of a cloud', [Run(FR079, 0.1, 1, point_step=step) for step in steps]
    yield 'points of a cloud', [Run(KITTI, 0.2, 1, clouds=6, point_step=step) for step in steps]
    yield '1 / edge of a voxel', [Run(FR079, edge_m, 1) for edge_m in (0.4, 0.2, 0.1, 0.05, *((0.025,) if is_large else ()))]
    yield '1 / edge of a voxel', [Run(KITTI, edge_m, 1, clouds=6) for edge_m in (0.8, 0.4, 0.2, *((0.1,) if is_large else ()))]
    yield 'size of the map', [Run(FR079, 0.1, 1, laps=count) for count in laps]
    yield 'size of the map', [Run(KITTI, 0.2, 1, laps=count, peers='none') for count in (*laps, *((27, 81) if is_large else ()))]
    if is_large:
        yield 'size of the map', [Run(KITTI, 0.1, 1, laps=count, peers='none') for count in (1, 2, 5, 10, 20, 40)]


def scaling_runs(is_large=False):
    return [run for _, runs in scaling(is_large) for run in runs]


def all_runs(is_quick, processes=PROCESSES):
    runs = [*headlines(), *fine_voxels(), *variants(), *resolution_sweep(FR079), *resolution_sweep(KITTI),
            *range_sweep(), *cloud_sweep(), *branching_sweep(), *long_drives(), *other_maps(), *scaling_runs(),
            *sampled_clouds(), *(run for _, run in spacings()), *process_runs(processes)]
    if is_quick:  # Without OctoMap's long runs.
        runs = [run for run in runs if run.dataset in (FR079, RGBD) and not {'shuffle', 'cloud_samples'} & run.options.keys()]
        for run in runs:
            run.repeat = 1
    by_name = {}
    for run in runs:
        by_name.setdefault(run.name, run)
    return list(by_name.values())
