#!/usr/bin/python3
"""Plots how far poses by landmarks lie beside the path of the map: a drive on the other side of the same way.

    map_info campus.map --export-csv map.csv
    localize --map campus.map --bag drive.bag --output track.csv
    plot_beside.py --map map.csv --track track.csv --output beside.png

Prints the median and the quartiles. Positive is right of the path, looking where the map was recorded.
"""
import argparse
import sys
from pathlib import Path
from typing import Tuple

import numpy as np

import package_scripts  # noqa: F401
from evaluation_report.data import DataError, number, read_rows
from evaluation_report.files import written_whole
from evaluation_report.style import COLOURS, STYLE, plt

LONGEST_STEP_M = 10.0  # a path does not go on across a longer gap


def beside(path: np.ndarray, positions: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Of each position (n x 2, east and north in metres): how far along the path (m x 2), and beside it."""
    steps = np.diff(path, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    used = (lengths > 0) & (lengths <= LONGEST_STEP_M)
    starts, steps, lengths = path[:-1][used], steps[used], lengths[used]
    before = np.concatenate([[0.0], np.cumsum(lengths)])[:-1]
    along, aside = [], []
    for position in positions:
        offsets = position - starts
        shares = np.clip((offsets * steps).sum(axis=1) / lengths**2, 0.0, 1.0)
        nearest = np.argmin(np.linalg.norm(offsets - shares[:, None] * steps, axis=1))
        step, offset = steps[nearest], offsets[nearest]
        along.append(before[nearest] + shares[nearest] * lengths[nearest])
        aside.append((step[1] * offset[0] - step[0] * offset[1]) / lengths[nearest])
    return np.array(along), np.array(aside)


def positions_in(file: Path, source: str = '') -> np.ndarray:
    """East and north of each row; only of those with this source, if one is given."""
    needed = ('east_m', 'north_m') + (('source',) if source else ())
    positions = []
    for line, row in read_rows(file, needed):
        if source and row['source'] != source:
            continue
        position = [number(file, line, name, row[name]) for name in needed[:2]]
        if None in position:
            raise DataError(file, f'line {line}: east_m and north_m must be finite numbers')
        positions.append(position)
    return np.array(positions, dtype=float).reshape(-1, 2)


def draw(path: np.ndarray, positions: np.ndarray, along: np.ndarray, aside: np.ndarray) -> plt.Figure:
    """From above, and the offsets along the path."""
    figure, (above, offsets) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout='constrained')
    above.plot(*path.T, color=COLOURS['blue'], label='map')
    above.plot(*positions.T, '.', color=COLOURS['vermillion'], label='poses by landmarks')
    above.set(title='From above', xlabel='east [m]', ylabel='north [m]', aspect='equal')
    above.legend()
    offsets.axhline(0.0, color=COLOURS['blue'])
    offsets.plot(along, aside, '.', color=COLOURS['vermillion'])
    offsets.set(title='Right of the path of the map', xlabel='along it [m]', ylabel='[m]')
    return figure


def main() -> int:
    """Exit code 0, or 1 with one line when a file is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--map', type=Path, required=True, help='images of a map, CSV by map_info --export-csv')
    parser.add_argument('--track', type=Path, required=True, help='CSV by localize')
    parser.add_argument('--output', type=Path, required=True, help='PNG, SVG or PDF to write, by its ending')
    options = parser.parse_args()
    try:
        path, positions = positions_in(options.map), positions_in(options.track, 'METRIC')
        if len(path) < 2 or not len(positions):
            raise DataError(options.track, 'no pose by landmarks, or no path in the map: nothing to plot')
        along, aside = beside(path, positions)
        print('{} poses, right of the path: median {:.2f} m, quartiles {:.2f} and {:.2f} m, {:.0f} % right of it'.format(
            len(aside), *np.percentile(aside, [50, 25, 75]), 100 * (aside > 0).mean()))
        with plt.rc_context(STYLE), written_whole(options.output) as partial:
            draw(path, positions, along, aside).savefig(partial, format=options.output.suffix[1:].lower() or 'png')
    except DataError as failure:
        print(f'plot_beside: {failure}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
