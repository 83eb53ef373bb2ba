"""Figures of curves: errors over images and speeds, single runs, swarm diversity."""
import math
import re
from itertools import accumulate
from statistics import median
from typing import Any, Dict, List, Optional, Sequence, Tuple

from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from .data import Group, Results, Series
from .experiments import count_of, group_title, is_kidnapped, speed_of, thresholds_of
from .papers import Papers
from .style import COLOURS, PAPER_LINE, Palette, hide_unused, literal, page, plt, shape

FILTERS = re.compile(r'^PF\b')


def draw_steps(axis: plt.Axes, curves: Dict[str, Series], palette: Palette, column: str = 'mean_err_m') -> None:
    """One curve per method over the images since the start."""
    for method, series in curves.items():
        if series.has(column):
            axis.plot(series.step, series.columns[column], **palette.line(method), linewidth=1.2)
    axis.set(xlabel='images since the start', ylabel='mean error [m]')
    axis.set_xlim(left=0)
    axis.set_ylim(bottom=0)


def log_errors(axis: plt.Axes) -> None:
    """A logarithmic axis: shows how fast the methods localise and their final error."""
    axis.set_ylim(auto=True)
    axis.set_yscale('log')
    axis.yaxis.set_major_locator(FixedLocator([digit * 10.0 ** power for power in range(-3, 5) for digit in (1, 2, 5)]))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f'{value:g}'))
    axis.yaxis.set_minor_locator(NullLocator())


def steps_figure(results: Results, palette: Palette, title: str) -> Optional[plt.Figure]:
    """Mean error over the images of all runs, one panel per pair of groups ([H] Fig. 4 a to d)."""
    panels = {group: drawable(curves) for group, curves in results.steps.items()}
    panels = {group: curves for group, curves in panels.items() if curves}
    if not panels:
        return None
    methods = [name for name in results.methods() if any(name in curves for curves in panels.values())]
    rows, columns = shape(len(panels))
    figure, axes = page(title, rows, columns, 3.3 if len(panels) == 1 else 2.6, palette.handles(methods))
    for index, (axis, (group, curves)) in enumerate(zip(axes, panels.items())):
        draw_steps(axis, curves, palette)
        log_errors(axis)
        axis.set_title(literal(group_title(group)))
        axis.set_ylabel('' if index % columns else axis.get_ylabel())
    hide_unused(axes, len(panels))
    return figure


def drawable(curves: Dict[str, Series], column: str = 'mean_err_m') -> Dict[str, Series]:
    return {method: series for method, series in curves.items() if series.has(column)}


def kidnapped_figure(results: Results, palette: Palette, title: str) -> Optional[plt.Figure]:
    """Mean error over the images of the kidnapped runs ([J] Fig. 6)."""
    chosen = {group: {method: series for method, series in drawable(curves).items() if is_kidnapped(results, method)}
              for group, curves in results.steps.items()}
    kept = Results(results.experiment, results.description, results.outcomes, results.pairs, results.settings,
                   {group: curves for group, curves in chosen.items() if curves}, {})
    figure = steps_figure(kept, palette, title)
    if figure and len(results.pairs) == 1:
        for axis, curves in zip(figure.axes, kept.steps.values()):
            mark_kidnapping(axis, max(max(series.step) for series in curves.values()))
    return figure


def mark_kidnapping(axis: plt.Axes, last: float) -> None:
    """Marks the kidnapping at half of the run; only known when all runs have one length."""
    half = (last + 1) // 2
    axis.axvline(half, color='#555555', linewidth=.8, linestyle=(0, (2, 2)))
    axis.annotate('kidnapped', (half, 1), xycoords=('data', 'axes fraction'), xytext=(-4, -3),
                  textcoords='offset points', ha='right', va='top', fontsize=8, color='#555555')


def speed_figure(results: Results, papers: Papers, palette: Palette, title: str) -> Optional[plt.Figure]:
    """Mean error over the simulated speed, adaptive and not ([J] Fig. 4)."""
    groups = [group for group in results.groups() if any(speed_of(one.method) for one in results.of(group))]
    if not groups:
        return None
    variants = list(dict.fromkeys(speed[0] for speed in map(speed_of, results.methods()) if speed))
    markers = dict(zip(variants, 'os^Dv<>' * len(variants)))
    lines = {name: {**palette.line(f'{name} 1x'), 'linestyle': '-', 'marker': markers[name]} for name in variants}
    theirs = {name: {'color': PAPER_LINE, 'linestyle': '--', 'marker': markers[name], 'markerfacecolor': 'white'}
              for name in variants}
    drawn: Dict[str, Dict[str, Any]] = {}
    points = {group: speed_points(results, papers, group, variants) for group in groups}
    for curves in points.values():
        for name, (here, there) in curves.items():
            drawn.update({name: lines[name]} if here else {})
            drawn.update({f'{name} (papers)': theirs[name]} if there else {})
    handles = [Line2D([], [], label=literal(name), **style) for name, style in drawn.items()]
    rows, columns = shape(len(groups))
    figure, axes = page(title, rows, columns, 3.3, handles)
    for axis, (group, curves) in zip(axes, points.items()):
        for name, (here, there) in curves.items():
            axis.plot(*zip(*there), **theirs[name]) if there else None
            axis.plot(*zip(*here), **lines[name]) if here else None
        log_speeds(axis, sorted({x for both in curves.values() for line in both for x, _ in line}))
        axis.set(title=literal(group_title(group)), xlabel='simulated speed [multiples of the recorded speed]',
                 ylabel='mean error [m]')
        axis.set_ylim(bottom=0)
    hide_unused(axes, len(groups))
    return figure


Points = List[Tuple[float, float]]


def speed_points(results: Results, papers: Papers, group: Group,
                 variants: Sequence[str]) -> Dict[str, Tuple[Points, Points]]:
    """Our errors and the papers' over the speed, by variant."""
    curves: Dict[str, Tuple[Points, Points]] = {name: ([], []) for name in variants}
    for outcome in results.of(group):
        speed = speed_of(outcome.method)
        if not speed:
            continue
        values = (outcome.get('mean_err_m'), papers.lead(results.experiment, group, outcome.method, 'mean_err_m'))
        for line, value in zip(curves[speed[0]], values):
            if value is not None:
                line.append((speed[1], value))
    return {name: (sorted(here), sorted(there)) for name, (here, there) in curves.items()}


def log_speeds(axis: plt.Axes, speeds: Sequence[float]) -> None:
    """Doubled speeds at equal distances."""
    if not speeds or min(speeds) <= 0:
        return
    axis.set_xscale('log', base=2)
    axis.xaxis.set_major_locator(FixedLocator(list(speeds)))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.set_xticklabels([f'{speed:g}' for speed in speeds])


def runs_figure(traces: Dict[str, Series], palette: Palette, title: str) -> Optional[plt.Figure]:
    """Cumulated error, speed limit and speed of the swarm in single runs; recovery is shaded ([J] Fig. 5)."""
    swarms = {method: series for method, series in traces.items() if series.has('v0') and series.has('err_m')}
    if not swarms:
        return None
    handles: List[Any] = [Line2D([], [], color=COLOURS['black'], label='cumulated error'),
                          Line2D([], [], color=COLOURS['vermillion'], linestyle='--', label='speed limit v₀'),
                          Line2D([], [], color=COLOURS['blue'], label='speed of the swarm (EMA)')]
    metric = all(series.has('swarm_mps') for series in swarms.values())
    if metric and any(series.has('robot_mps') for series in swarms.values()):
        handles.append(Line2D([], [], color=COLOURS['green'], linestyle=':', label='speed of the robot v_R (median)'))
    if any(series.has('recovering') and any(value == 1 for value in series.columns['recovering'])
           for series in swarms.values()):
        handles.append(Patch(facecolor=COLOURS['orange'], alpha=.3, label='recovering'))
    figure, axes = page(title, len(swarms), 1, 2.1, handles, legend_width=len(handles), share_x=True)
    top = max(cumulated(series.columns['err_m'])[-1] for series in swarms.values())
    fastest = max((value for series in swarms.values() for values in speeds_of(series, metric).values()
                   for value in values if math.isfinite(value)), default=0)
    for axis, (method, series) in zip(axes, swarms.items()):
        draw_run(axis, series, metric)
        axis.set(title=literal(method), ylim=(0, top * 1.05 or 1))
        figure.axes[-1].set_ylim(0, fastest * 1.05 or 1)
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    axes[-1].set_xlabel('images since the start')
    return figure


def cumulated(errors: Sequence[float]) -> List[float]:
    """The sum of the errors so far; an error that is not known adds nothing."""
    return list(accumulate(0 if math.isnan(error) else error for error in errors))


def middle(values: Sequence[float]) -> List[float]:
    known = [value for value in values if math.isfinite(value)]
    return [median(known)] if known else []


def speeds_of(series: Series, metric: bool) -> Dict[str, List[float]]:
    """Speed limit, swarm and robot: metres per second, or per cent of the map's range per image.

    The limit is a share of the range, which each axis has of its own; in m/s it is that for the swarm's direction. With
    odometry, which moves the swarm beside its own speed, there is no such limit.
    """
    limit, swarm = (series.columns.get(name, []) for name in ('v0', 'speed_ema'))
    if not metric:
        return {'limit': [100 * value for value in limit], 'swarm': [100 * value for value in swarm], 'robot': []}
    metres = series.columns['swarm_mps']
    return {'limit': [v0 * mps / share if share else math.nan for v0, share, mps in zip(limit, swarm, metres)],
            'swarm': metres, 'robot': middle(series.columns.get('robot_mps', []))}


def draw_run(axis: plt.Axes, series: Series, metric: bool) -> None:
    if series.has('recovering'):
        shade(axis, series.step, series.columns['recovering'])
    axis.plot(series.step, cumulated(series.columns['err_m']), color=COLOURS['black'], linewidth=1.2)
    axis.set_ylabel('cumulated error [m]')
    axis.set_xlim(series.step[0], series.step[-1])
    right = axis.twinx()
    right.grid(False)
    right.spines['right'].set_visible(True)
    speeds = speeds_of(series, metric)
    for name, style in (('limit', {'color': COLOURS['vermillion'], 'linestyle': '--'}),
                        ('swarm', {'color': COLOURS['blue']})):
        if speeds[name]:
            right.plot(series.step, speeds[name], linewidth=1.1, **style)
    for robot_mps in speeds['robot']:
        right.axhline(robot_mps, color=COLOURS['green'], linestyle=':', linewidth=1.1)
    right.set_ylabel('speed [m/s]' if metric else 'speed [% of the\nrange per image]')


def shade(axis: plt.Axes, steps: Sequence[float], flags: Sequence[float]) -> None:
    """Marks the images where the flag is set."""
    begin: Optional[float] = None
    for step, flag in list(zip(steps, flags)) + [(steps[-1] + 1, 0)]:
        if flag == 1 and begin is None:
            begin = step
        elif flag != 1 and begin is not None:
            axis.axvspan(begin - .5, step - .5, color=COLOURS['orange'], alpha=.3, linewidth=0)
            begin = None


def diversity_figure(traces: Dict[str, Series], palette: Palette, title: str) -> Optional[plt.Figure]:
    """Mean distance of the particles over the images of single runs ([J] Fig. 7 and 9)."""
    chosen = drawable(traces, 'diversity_m')
    if not chosen:
        return None
    figure, axes = page(title, 1, 1, 3, palette.handles(list(chosen)))
    draw_steps(axes[0], chosen, palette, 'diversity_m')
    axes[0].set_ylabel('mean distance of particles [m]')
    return figure


def diversity_parts(traces: Dict[str, Series]) -> Dict[str, Dict[str, Series]]:
    """All swarms together; with particle filters, also one swarm beside them."""
    swarms = {method: series for method, series in traces.items() if not FILTERS.match(method)}
    filters = {method: series for method, series in traces.items() if FILTERS.match(method)}
    if not filters or not swarms:
        return {'diversity': traces}
    leader = next((name for name in ('DPSO-80', 'paper recovery') if name in swarms), next(iter(swarms)))
    own = {name: series for name, series in swarms.items() if not name.startswith('DPSO-')} or swarms
    return {'diversity': own, 'diversity_filters': {leader: swarms[leader], **filters}}


def counts_figure(results: Results, palette: Palette, title: str) -> Optional[plt.Figure]:
    """Mean error over the images for different numbers of particles, averaged over pairs of groups ([H] Fig. 4 e)."""
    merged = {method: averaged([curves[method] for curves in results.steps.values() if method in curves])
              for method in results.methods() if count_of(method)}
    merged = drawable(merged)
    kinds = list(dict.fromkeys(count_of(method)[0] for method in merged))  # type: ignore[index]
    if not kinds:
        return None
    rows, columns = shape(len(kinds))
    figure, axes = page(title, rows, columns, 2.7, palette.handles(list(merged)), legend_width=len(kinds))
    low, top = math.inf, 0.0
    for axis, kind in zip(axes, kinds):
        draw_steps(axis, {name: series for name, series in merged.items() if count_of(name)[0] == kind},  # type: ignore
                   palette)
        log_errors(axis)
        axis.set_title(literal(kind))
        low, top = min(low, axis.get_ylim()[0]), max(top, axis.get_ylim()[1])
    for index, axis in enumerate(axes):
        axis.set_ylim(low, top)
        axis.set_ylabel('' if index % columns else axis.get_ylabel())
    hide_unused(axes, len(kinds))
    return figure


def averaged(curves: Sequence[Series]) -> Series:
    """The mean of several curves at each step, over those that have not ended."""
    sums: Dict[float, List[float]] = {}
    for series in curves:
        for step, value in zip(series.step, series.columns.get('mean_err_m', [])):
            if math.isfinite(value):
                sums.setdefault(step, []).append(value)
    mean = Series()
    for step in sorted(sums):
        mean.add(step, {'mean_err_m': sum(sums[step]) / len(sums[step])})
    return mean


def thresholds_figure(results: Results, title: str) -> Optional[plt.Figure]:
    """Mean error and share of SIFT steps over the thresholds, one panel per pair of groups ([H] Fig. 4 f)."""
    panels = []
    for group in results.groups():
        points = [(thresholds_of(results, one.method), one.get('mean_err_m'), one.get('sift_share'))
                  for one in results.of(group)]
        known = sorted((limits, error, share) for limits, error, share in points
                       if limits and error is not None and share is not None)
        if known:
            panels.append((group, known))
    if not panels:
        return None
    handles = [Line2D([], [], color=COLOURS['blue'], marker='o', label='mean error'),
               Line2D([], [], color=COLOURS['vermillion'], marker='s', linestyle='--', label='SIFT steps')]
    rows, columns = shape(len(panels))
    columns = min(columns, 2)
    figure, axes = page(title, -(-len(panels) // columns), columns, 3, handles)
    for axis, (group, known) in zip(axes, panels):
        draw_thresholds(axis, known)
        axis.set_title(literal(group_title(group)))
    hide_unused(axes, len(panels))
    return figure


def draw_thresholds(axis: plt.Axes, known: Sequence[Tuple[Tuple[float, float], float, float]]) -> None:
    """Error on the left axis, SIFT share on the right axis."""
    indices = range(len(known))
    axis.plot(indices, [error for _, error, _ in known], 'o-', color=COLOURS['blue'])
    axis.set_xticks(indices)
    axis.set_xticklabels([f'({above:g}, {below:g})' for (above, below), _, _ in known], rotation=60, fontsize=7.5)
    axis.set(xlabel='thresholds (d_global, d_SIFT) [m]')
    axis.set_ylabel('mean error [m]', color=COLOURS['blue'])
    axis.set_ylim(bottom=0)
    right = axis.twinx()
    right.grid(False)
    right.spines['right'].set_visible(True)
    right.plot(indices, [100 * share for _, _, share in known], 's--', color=COLOURS['vermillion'])
    right.set_ylabel('SIFT steps [%]', color=COLOURS['vermillion'])
    right.set_ylim(bottom=0)
