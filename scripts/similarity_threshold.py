#!/usr/bin/python3
"""Finds similarity/sift_recognised for a camera: from which similarity on the best match is of the right place.

TRACK is of `localize --tracker exhaustive --preset paper`, in which every image is compared with the whole map; BAG has
the true positions of that drive. Prints shares of right and wrong matches over thresholds, and the lowest threshold
that leaves at most --false of the accepted matches wrong.
"""
import argparse
import csv
from pathlib import Path
from typing import Optional

import numpy as np
from local_frame import LocalFrame, fixes_of


def matches_of(track: Path, truth: np.ndarray) -> np.ndarray:
    """Rows of similarity and distance of the matched place from the truth, metres."""
    with open(track, newline='', encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise ValueError(f'{track}: there is no image in it')
    frame = LocalFrame(rows[0])
    true = frame.position(truth[:, 1], truth[:, 2])
    stamp, east, north, similarity = (np.array([float(row[name]) for row in rows])
                                      for name in ('stamp', 'east_m', 'north_m', 'similarity'))
    off_m = [np.interp(stamp, truth[:, 0], true[:, axis]) - position for axis, position in ((0, east), (1, north))]
    return np.column_stack((similarity, np.hypot(*off_m)))


def lowest(similarity: np.ndarray, right: np.ndarray, most_false: float) -> Optional[float]:
    """The lowest similarity from which on at most a share of the matches is wrong."""
    order = np.argsort(-similarity)
    wrong_share = np.cumsum(~right[order]) / np.arange(1, len(order) + 1)
    accepted = np.flatnonzero(wrong_share <= most_false)
    return float(similarity[order][accepted[-1]]) if len(accepted) else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('track', type=Path)
    parser.add_argument('bag', type=Path)
    parser.add_argument('--truth-topic', default='/ground_truth/fix', help='(default: %(default)s)')
    parser.add_argument('--right', type=float, default=5.0, help='metres (default: %(default)s)')
    parser.add_argument('--false', type=float, default=0.05, help='share (default: %(default)s)')
    args = parser.parse_args()
    try:
        matches = matches_of(args.track, fixes_of(args.bag, args.truth_topic))
    except (ValueError, OSError, KeyError) as error:
        raise SystemExit(f'similarity_threshold: {error}') from error
    similarity, right = matches[:, 0], matches[:, 1] <= args.right
    print('threshold  accepted  of them wrong  right ones lost')
    for threshold in (0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.15, 0.2):
        accepted = similarity >= threshold
        wrong = np.mean(~right[accepted]) if accepted.any() else 0.0
        lost = np.mean(~accepted[right]) if right.any() else 0.0
        print(f'{threshold:9.2f}  {accepted.mean():8.1%}  {wrong:13.1%}  {lost:15.1%}')
    found = lowest(similarity, right, args.false)
    if found is None:
        raise SystemExit(f'similarity_threshold: at every threshold more than {args.false:.0%} are wrong')
    print(f'similarity/sift_recognised: {found:.3f}')


if __name__ == '__main__':
    main()
