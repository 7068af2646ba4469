# SPDX-License-Identifier: BSD-3-Clause
"""Plots of doc/performance.md, from the reports of compare_maps."""
import subprocess

from benchmark_runs import FR079, KITTI, PEERS, SHORT_NAMES, branching_sweep, cloud_sweep, range_sweep, resolution_sweep


class Plot:
    """Curves over one option, drawn by gnuplot; a tick for each x, unless these are not chosen but measured."""

    def __init__(self, file, x_label, y_label, is_log=True, is_measured=False):
        self.file = file
        self.settings = [f'set xlabel "{x_label}"', f'set ylabel "{y_label}"', 'set key outside',
                         'set grid', 'set autoscale xfix', 'set logscale y' if is_log else 'set yrange [0:*]']
        if is_log and not is_measured:
            self.settings.append('set logscale x')
        self.is_measured = is_measured
        self.curves = []
        self.ticks = set()

    def add(self, title, points):
        if points:
            self.curves.append((title, sorted(points)))
            self.ticks.update(x for x, _ in points)

    def draw(self):
        """Returns whether there was anything to draw."""
        if not self.curves:
            return False
        self.file.parent.mkdir(parents=True, exist_ok=True)
        if not self.is_measured:
            ticks = ', '.join(f'"{x:g}" {x:g}' for x in sorted(self.ticks))
            self.settings.append(f'set xtics ({ticks})')
        # A curve of one point is marked as such: there is no line that would lead to it.
        plots = ', '.join('"-" using 1:2 with ' +
                          (f'linespoints pointtype 7 pointsize 0.6 title "{title}"' if len(points) > 1 else
                           f'points pointtype 2 pointsize 1.5 title "{title}, one point"')
                          for title, points in self.curves)
        data = ''.join(''.join(f'{x:g} {y:g}\n' for x, y in points) + 'e\n' for _, points in self.curves)
        script = '\n'.join(['set terminal svg size 900,400 background "white" font "sans,12" noenhanced',
                            f'set output "{self.file}"', *self.settings,
                            f'plot {plots}', data])
        subprocess.run(['gnuplot'], input=script, text=True, check=True)
        return True


def add_curves(plot, title, runs, reports, x_of, y_of):
    """A curve for every map that took part."""
    found = reports.of(list(runs))
    for name, label in {'cuboid_mapping': 'cuboid_mapping', **PEERS}.items():
        plot.add(f'{label}{title}', [(x_of(r), y_of(r, r[name])) for r in found if name in r])


def ms_per_cloud(report, figures):
    return 1e3 * figures['insert_cpu_s'] / report['clouds']


def draw_plots(reports, folder):
    """Returns lines of markdown by name of the plot."""
    plots = {}
    resolution = Plot(folder / 'resolution.svg', 'voxel [m]', 'insertion, CPU ms per cloud')
    for dataset in (FR079, KITTI):
        add_curves(resolution, ', ' + SHORT_NAMES[dataset], resolution_sweep(dataset),
                   reports, lambda r: r['resolution_m'], ms_per_cloud)
    plots['resolution'] = resolution
    max_range = Plot(folder / 'range.svg', 'max range [m]', 'insertion, CPU ms per cloud')
    add_curves(max_range, '', range_sweep(), reports, lambda r: r['max_range_m'], ms_per_cloud)
    plots['range'] = max_range
    clouds = Plot(folder / 'clouds.svg', 'clouds in the map', 'insertion, CPU ms per cloud')
    add_curves(clouds, '', cloud_sweep(), reports, lambda r: r['clouds'], ms_per_cloud)
    plots['clouds'] = clouds
    found = reports.of(list(branching_sweep()))
    branching = Plot(folder / 'branching.svg', 'M', 'relative to M = 32', is_log=False)
    default = [r['cuboid_mapping'] for r in found if r['branching'] == 32]
    if default:
        for title, figure in {
                'insertion': lambda f: f['insert_cpu_s'],
                'heap': lambda f: f['bytes_heap'],
                'a point query': lambda f: 1 / f['point_queries_per_s']['uniform'],
                'a box query': lambda f: 1 / f['box_queries_per_s']['uniform'],
                'a ray': lambda f: 1 / f['ray_queries_per_s']['uniform']}.items():
            branching.add(title, [(r['branching'], figure(r['cuboid_mapping']) / figure(default[0]))
                                  for r in found])
    plots['branching'] = branching
    return {name: f'![{name}]({folder.name}/{plot.file.name})' if plot.draw() else 'Not measured.'
            for name, plot in plots.items()}
