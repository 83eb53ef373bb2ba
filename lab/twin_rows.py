#!/usr/bin/python3
"""How much of the time that a robot is in one of the town's twin rows of houses a track has it in the other.

Reads tracks of `localize` and the drive's true positions; the rows are those of `render_world.py --world town`.
Prints the share of images at the twin, and of images that are farther than --far from the truth, there and everywhere.
"""
import argparse
import csv
import sys
from pathlib import Path
from typing import List, Tuple

import numpy as np

import package_scripts  # noqa: F401
from local_frame import LocalFrame
from make_round_bag import LATITUDE_DEG, LONGITUDE_DEG
from map_error import truth_of
from worlds.town_course import TWIN_ROWS, TownPlan

JUNCTION_M = 8  # no house is nearer to the end of a street
STREET_M = 6  # from its middle
TOWN = LocalFrame({'latitude_deg': LATITUDE_DEG, 'longitude_deg': LONGITUDE_DEG, 'east_m': 0, 'north_m': 0})


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('tracks', type=Path, nargs='+', metavar='TRACK', help='CSV that localize wrote')
    parser.add_argument('--bag', type=Path, required=True, help='the drive, of make_round_bag.py')
    parser.add_argument('--seed', type=int, default=1, help='of the town (default: %(default)s)')
    parser.add_argument('--truth-topic', default='/ground_truth/fix', help='(default: %(default)s)')
    parser.add_argument('--far', type=float, default=10, help='metres (default: %(default)g)')
    return parser.parse_args()


def inside(points: np.ndarray, street: Tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Which points are beside the houses of a street."""
    along = (street[1] - street[0]) / np.linalg.norm(street[1] - street[0])
    offset = points - street[0]
    way, aside = offset @ along, offset @ np.array([-along[1], along[0]])
    return ((way > JUNCTION_M) & (way < np.linalg.norm(street[1] - street[0]) - JUNCTION_M)
            & (np.abs(aside) < STREET_M))


def positions(track: Path, truth: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    with open(track, newline='', encoding='utf-8') as file:
        rows = np.array([[float(row[name]) for name in ('stamp', 'latitude_deg', 'longitude_deg')]
                         for row in csv.DictReader(file)])
    true = [np.interp(rows[:, 0], truth[:, 0], truth[:, axis]) for axis in (1, 2)]
    return TOWN.position(rows[:, 1], rows[:, 2]), np.column_stack(true)


def percent(which: List[np.ndarray]) -> str:
    return f'{100 * np.concatenate(which).mean():.2f} %'


def main() -> None:
    args = arguments()
    nodes = TownPlan(args.seed).nodes
    rows = [tuple(np.array(nodes[name]) for name in row) for row in TWIN_ROWS]
    truth = truth_of(args.bag, args.truth_topic, TOWN)
    at_twin, far_there, far = [], [], []
    for track in args.tracks:
        found, true = positions(track, truth)
        far.append(np.linalg.norm(found - true, axis=1) > args.far)
        for own, other in (rows, rows[::-1]):
            there = inside(true, own)
            at_twin.append(inside(found[there], other))
            far_there.append(far[-1][there])
    print(f'{len(args.tracks)} tracks, {len(np.concatenate(at_twin))} images in twin rows: {percent(at_twin)} at the '
          f'twin, {percent(far_there)} farther off than {args.far:g} m; of all images {percent(far)}')


if __name__ == '__main__':
    main()
