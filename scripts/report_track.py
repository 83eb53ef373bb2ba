#!/usr/bin/python3
"""Judges and plots a track that record_track.py wrote.

Prints what became of the images, error, cost and states, and draws track, error and state over time as PNG and SVG;
with --places also the error of the same drive without landmarks, from what `localize --pose-source place` wrote.
Exit code 1 when the robot was not localised: no pose, never tracking, or a median error above --max-median-error; and
when the counts of images do not add up.
"""
import argparse
import csv
import json
import math
import sys
from pathlib import Path
from typing import Dict, List, Optional, Tuple

import matplotlib
matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
sys.path.insert(0, str(Path(__file__).resolve().parent))
from local_frame import metres_per_degree  # noqa: E402

STATES = ['INITIALIZING', 'TRACKING', 'UNCERTAIN', 'RECOVERING', 'OFF_MAP']
COLOURS = {'INITIALIZING': '#7f7f7f', 'TRACKING': '#2ca02c', 'UNCERTAIN': '#ff7f0e', 'RECOVERING': '#d62728',
           'OFF_MAP': '#9467bd'}


SOURCES = {'METRIC': '#2166ac', 'PLACE': '#e08214', 'NONE': '#7f7f7f', '': '#1f77b4'}


class Track:
    """The columns of a track; NaN where a cell is empty."""

    def __init__(self, rows: List[Dict[str, str]]):
        self.count = len(rows)
        self.stamps = self._column(rows, 'stamp')
        self.seconds = self.stamps - self.stamps[0]
        self.east, self.north = self._column(rows, 'east_m'), self._column(rows, 'north_m')
        self.error = self._column(rows, 'error_m')
        self.comparisons, self.swept = self._column(rows, 'comparisons'), self._column(rows, 'swept')
        self.milliseconds = sum(self._column(rows, name) for name in ('extract_ms', 'match_ms', 'update_ms'))
        self.states = np.array([row['state'] for row in rows])
        self.sources = np.array([row.get('source', '') for row in rows])  # not in tracks of older versions
        self.inliers, self.sigma = self._column(rows, 'inliers'), self._column(rows, 'sigma_m')
        self.true_east, self.true_north = self._truth(rows)

    @staticmethod
    def _column(rows: List[Dict[str, str]], name: str) -> np.ndarray:
        return np.array([float(row.get(name) or 'nan') for row in rows])

    def _truth(self, rows: List[Dict[str, str]]) -> Tuple[np.ndarray, np.ndarray]:
        """The exact positions in the map frame, which one image with both pose and fix ties to the ellipsoid."""
        latitude, longitude = self._column(rows, 'latitude_deg'), self._column(rows, 'longitude_deg')
        known = np.flatnonzero(np.isfinite(self.east) & np.isfinite(latitude))
        if not known.size:
            return np.full(self.count, math.nan), np.full(self.count, math.nan)
        tie = known[0]
        east_m, north_m = metres_per_degree(latitude[tie])
        return (self.east[tie] + (self._column(rows, 'true_longitude_deg') - longitude[tie]) * east_m,
                self.north[tie] + (self._column(rows, 'true_latitude_deg') - latitude[tie]) * north_m)


class Counts:
    """What became of the images of the bag."""

    def __init__(self, path: Path):
        try:
            values = json.loads(path.read_text(encoding='utf-8'))
        except (OSError, ValueError) as error:
            raise SystemExit(f'report_track: no counts of images in {path}: {error}') from error
        self.in_bag, self.answered = values['in_bag'], values['answered']
        self.received, self.processed = values['received'], values['processed']
        self.dropped, self.late, self.refused = values['dropped'], values['late'], values['refused']
        self.without_map = values['without_map']
        self.never_received = self.in_bag - self.received

    def line(self) -> str:
        return (f'images           {self.in_bag} in the bag: {self.answered} answered, {self.dropped} dropped for a '
                f'newer one, {self.late} late, {self.refused} refused, {self.without_map} before there was a map, '
                f'{self.never_received} never received')

    def contradiction(self) -> Optional[str]:
        """Why the counts do not add up, in words; None when they do."""
        if self.never_received < 0:
            return (f'the node received {self.received} images, more than the {self.in_bag} of the bag: something else '
                    f'publishes on its topic')
        if self.answered != self.processed:
            return f'the node answered {self.processed} images, but {self.answered} answers were recorded'
        ends = self.answered + self.dropped + self.late + self.refused + self.without_map
        if ends != self.received:
            return (f'the node received {self.received} images, but {ends} are answered, dropped, late, refused or came '
                    f'before there was a map')
        return None


def read_csv(path: Path) -> List[Dict[str, str]]:
    with open(path, newline='', encoding='utf-8') as file:
        return list(csv.DictReader(file))


def read_map(path: Optional[Path]) -> Optional[Tuple[np.ndarray, np.ndarray]]:
    """East and north of the training images from `map_info --export-csv`."""
    if path is None:
        return None
    rows = read_csv(path)
    if not rows or not {'east_m', 'north_m'} <= rows[0].keys():
        raise SystemExit(f'report_track: {path} has no columns east_m and north_m')
    return np.array([float(row['east_m']) for row in rows]), np.array([float(row['north_m']) for row in rows])


class Places:
    """The same drive without landmarks: how far each of its poses is from the exact position of the image."""

    def __init__(self, path: Path, track: Track):
        known = np.flatnonzero(np.isfinite(track.true_east))
        truth = {round(track.stamps[i], 3): i for i in known}
        rows = [(truth[round(float(row['stamp']), 3)], row) for row in read_csv(path)
                if round(float(row['stamp']), 3) in truth]
        self.seconds = np.array([track.seconds[i] for i, _ in rows])
        self.error = np.array([math.hypot(float(row['east_m']) - track.true_east[i],
                                          float(row['north_m']) - track.true_north[i]) for i, row in rows])


def summary(track: Track) -> List[str]:
    """What came out, in lines for people."""
    judged = track.error[np.isfinite(track.error)]
    poses = int(np.isfinite(track.east).sum())
    lines = [f'poses            {poses} of {track.count} answers']
    if judged.size:
        lines.append(f'error            mean {judged.mean():.2f} m, median {np.median(judged):.2f} m, '
                     f'within 5 m {100 * np.mean(judged < 5):.1f} %')
        tracking = track.error[(track.states == 'TRACKING') & np.isfinite(track.error)]
        if tracking.size:
            lines.append(f'  while tracking mean {tracking.mean():.2f} m, median {np.median(tracking):.2f} m')
    lines += metric_summary(track)
    lines.append(f'comparisons      {np.nanmean(track.comparisons):.1f} per image')
    if np.isfinite(track.swept).any():  # not in tracks of older versions
        lines.append(f'swept            {np.nanmean(track.swept):.1f} per image')
    lines.append(f'time             {np.nanmean(track.milliseconds):.1f} ms per image')
    shares = [(state, 100 * np.mean(track.states == state)) for state in STATES]
    lines.append('states           ' + ', '.join(f'{state} {share:.1f} %' for state, share in shares if share))
    return lines


def metric_summary(track: Track) -> List[str]:
    """How many poses were solved from landmarks and how good they are; nothing in a map of places."""
    metric = track.sources == 'METRIC'
    if not metric.any():
        return []
    judged = track.error[metric & np.isfinite(track.error)]
    error = f', error median {np.median(judged):.2f} m, 95 % within {np.quantile(judged, .95):.2f} m' \
        if judged.size else ''
    return [f'metric poses     {100 * metric.mean():.1f} % of the answers{error}',
            f'                 median of {np.median(track.inliers[metric]):.0f} inliers, sigma '
            f'{np.median(track.sigma[metric]):.2f} m']


def failure(track: Track, max_median_error_m: float) -> Optional[str]:
    """Why this counts as not localised, in words; None when it was."""
    judged = track.error[np.isfinite(track.error)]
    if not judged.size:
        return 'no pose whose exact position is known'
    if not (track.states == 'TRACKING').any():
        return 'the localizer never reached TRACKING'
    if np.median(judged) > max_median_error_m:
        return f'the median error of {np.median(judged):.2f} m is above {max_median_error_m:.2f} m'
    return None


def plot_track(axes: plt.Axes, track: Track, training: Optional[Tuple[np.ndarray, np.ndarray]]) -> None:
    """The map, the exact path and the estimates, coloured by state."""
    if training:
        axes.plot(*training, '.', color='#c7d5e5', markersize=6, label='training images')
    axes.plot(track.true_east, track.true_north, '-', color='black', linewidth=1, label='exact path')
    for state in STATES:
        chosen = (track.states == state) & np.isfinite(track.east)
        if chosen.any():
            axes.plot(track.east[chosen], track.north[chosen], '.', color=COLOURS[state], markersize=4,
                      label=state.lower())
    axes.set(xlabel='east [m]', ylabel='north [m]', aspect='equal', title='Track')
    axes.legend(fontsize='small', loc='center')
    axes.grid(alpha=.3)


def plot_error(axes: plt.Axes, track: Track, places: Optional[Places]) -> None:
    """Error over time, by what the pose rests on; logarithmic, since being lost is worse by magnitudes."""
    if places is not None and places.error.size:
        axes.plot(places.seconds, np.maximum(places.error, .01), color='#a0a0a0', linewidth=1,
                  label=f'without landmarks, median {np.median(places.error):.2f} m')
    for source, colour in SOURCES.items():
        chosen = (track.sources == source) & np.isfinite(track.error)
        if chosen.any():
            axes.plot(track.seconds[chosen], np.maximum(track.error[chosen], .01), '.', color=colour, markersize=4,
                      label=f'{source or "pose"}, median {np.median(track.error[chosen]):.2f} m')
    axes.axhline(5, color='black', linewidth=.8, linestyle='--')
    axes.set(yscale='log', ylabel='error [m]', title='Error')
    if axes.get_legend_handles_labels()[0]:
        axes.set_ylim(top=6 * axes.get_ylim()[1])  # room for it
        axes.legend(fontsize='small', loc='upper right')
    axes.grid(alpha=.3, which='both')


def plot_states(axes: plt.Axes, track: Track) -> None:
    for level, state in enumerate(STATES):
        chosen = track.states == state
        axes.plot(track.seconds[chosen], np.full(chosen.sum(), level), '|', color=COLOURS[state], markersize=10)
    axes.set(xlabel='time [s]', yticks=range(len(STATES)), ylim=(-.6, len(STATES) - .4), title='State')
    axes.set_yticklabels([state.lower() for state in STATES])
    axes.grid(alpha=.3)


def plot(track: Track, training: Optional[Tuple[np.ndarray, np.ndarray]], places: Optional[Places],
         prefix: Path) -> List[Path]:
    figure = plt.figure(figsize=(13, 6), constrained_layout=True)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.3, 1], height_ratios=[1.6, 1])
    plot_track(figure.add_subplot(grid[:, 0]), track, training)
    over_time = figure.add_subplot(grid[0, 1])
    plot_error(over_time, track, places)
    plot_states(figure.add_subplot(grid[1, 1], sharex=over_time), track)
    paths = [prefix.with_name(prefix.name + suffix) for suffix in ('.png', '.svg')]
    for path in paths:
        figure.savefig(path, dpi=110)
    plt.close(figure)
    return paths


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('track', type=Path, help='CSV that record_track.py wrote')
    parser.add_argument('--counts', type=Path, help='JSON that record_track.py wrote (default: beside the track)')
    parser.add_argument('--map-csv', type=Path, help='what map_info --export-csv wrote')
    parser.add_argument('--places', type=Path, help='what localize --pose-source place wrote of the same drive')
    parser.add_argument('--plot', type=Path, help='path of the plots without suffix (default: beside the track)')
    parser.add_argument('--max-median-error', type=float, default=10.0, help='metres (default: %(default)s)')
    return parser.parse_args()


def main() -> int:
    args = parse_arguments()
    rows = read_csv(args.track)
    if not rows:
        print(f'report_track: {args.track} holds no image', file=sys.stderr)
        return 1
    track = Track(rows)
    counts = Counts(args.counts or args.track.with_suffix('.json'))
    print('\n'.join([counts.line()] + summary(track)))
    places = Places(args.places, track) if args.places else None
    paths = plot(track, read_map(args.map_csv), places, args.plot or args.track.with_suffix(''))
    print('plot             ' + ' and '.join(str(path) for path in paths))
    if counts.dropped or counts.never_received:
        print('report_track: images came faster than this machine takes them; play the bag slower', file=sys.stderr)
    contradiction = counts.contradiction()
    if contradiction:
        print(f'report_track: the counts do not add up: {contradiction}', file=sys.stderr)
        return 1
    reason = failure(track, args.max_median_error)
    if reason:
        print(f'report_track: not localised: {reason}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
