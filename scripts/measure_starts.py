#!/usr/bin/env python3
"""Localises a round from several start images, as the papers do, and prints the figures over all runs.

Each run sees every image of the closed round once, begins at another one and has another seed. With --kidnap the
robot is carried to the other side of the round after half of the images.
"""
import argparse
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

FIGURES = {
    'error_m': r'error: mean ([\d.]+) m',
    'median_m': r'median ([\d.]+) m',
    'within_5m': r'within 5 m ([\d.]+) %',
    'comparisons': r'comparisons per image ([\d.]+)',
    'tracking': r'TRACKING ([\d.]+) %',
    'extract_ms': r'extract ([\d.]+)',
    'match_ms': r'match ([\d.]+)',
}


def parse_arguments() -> argparse.Namespace:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('localize', type=Path, help='the program')
    parser.add_argument('map', type=Path)
    parser.add_argument('bag', type=Path, help='round to localise')
    parser.add_argument('--starts', type=int, default=8, help='number of runs (default 8)')
    parser.add_argument('--kidnap', action='store_true')
    parser.add_argument('--truth-topic', default='/ground_truth/fix')
    return parser.parse_args()


def count_images(arguments: argparse.Namespace) -> int:
    """The number of images, from what the program says about an index far beyond."""
    result = run(arguments, ['--start-index', str(10**9)], check=False)
    found = re.search(r'images 0 to (\d+)', result.stderr)
    if not found:
        sys.exit(result.stderr.strip())
    return int(found.group(1)) + 1


def run(arguments: argparse.Namespace, options: list, check: bool = True) -> subprocess.CompletedProcess:
    """One run of the program."""
    with tempfile.TemporaryDirectory() as folder:
        command = [arguments.localize, '--map', arguments.map, '--bag', arguments.bag, '--truth-topic',
                   arguments.truth_topic, '--output', Path(folder) / 'track.csv', *options]
        result = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if check and result.returncode != 0:
        sys.exit(result.stderr.strip())
    return result


def options_of(number: int, images: int, arguments: argparse.Namespace) -> list:
    """Start, seed and jump of one run."""
    start = number * images // arguments.starts
    options = ['--start-index', start, '--seed', number + 1]
    if arguments.kidnap:
        half = images // 2
        options += ['--kidnap-at', half, '--kidnap-to', (start + 2 * half) % images]
    return options


def main() -> None:
    """Runs all and prints a line for each and one for the mean."""
    arguments = parse_arguments()
    images = count_images(arguments)
    runs = []
    for number in range(arguments.starts):
        output = run(arguments, options_of(number, images, arguments)).stdout
        runs.append({name: float(re.search(pattern, output).group(1)) for name, pattern in FIGURES.items()})
        print(f'run {number + 1}: mean error {runs[-1]["error_m"]:.2f} m')
    print(f'{arguments.starts} runs of {images} images, mean of each figure:')
    for name in FIGURES:
        print(f'  {name} {statistics.mean(entry[name] for entry in runs):.2f}')


if __name__ == '__main__':
    main()
