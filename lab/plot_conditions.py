#!/usr/bin/python3
"""Plots in which light the pairs of an experiment were recorded: how often each grey occurs in the images of map and
drive, and how sharp they are.

    plot_conditions.py --config config/evaluation/real.yaml --rounds ~/rounds --output conditions.png
"""
import argparse
import sys
from pathlib import Path
from typing import Dict, Tuple

import cv2
import numpy as np
import rosbag

import package_scripts  # noqa: F401
from evaluation_report.data import DataError, read_description
from evaluation_report.files import written_whole
from evaluation_report.style import COLOURS, STYLE, hide_unused, literal, page, plt, shape
from matplotlib.lines import Line2D

BINS = 32


def greys(bag: Path, topic: str, every: int) -> Tuple[np.ndarray, float]:
    """Share of each range of greys in one image of so many, and the median step from pixel to pixel."""
    counts, steps = np.zeros(BINS), []
    try:
        with rosbag.Bag(str(bag)) as file:
            for index, (_, message, _) in enumerate(file.read_messages([f'{topic}/compressed'])):
                pixels = None
                if index % every == 0:
                    pixels = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_GRAYSCALE)
                if pixels is not None:
                    counts += np.histogram(pixels, BINS, (0, 256))[0]
                    steps.append(np.abs(np.diff(pixels.astype(float), axis=1)).mean())
    except (OSError, rosbag.ROSBagException) as error:
        raise DataError(bag, f'cannot be read: {error}') from error
    if not steps:
        raise DataError(bag, f'has no image on {topic}/compressed')
    return counts / counts.sum(), float(np.median(steps))


def draw(experiment: dict, folder: Path, every: int) -> plt.Figure:
    """A panel for each pair."""
    rounds = experiment['rounds']
    bags = {bag['name']: folder / bag['bag'] for bag in rounds['bags']}
    pairs = [tuple(pair) for pair in experiment['pairs'] if set(pair) <= set(bags)]
    pairs = [pair for index, pair in enumerate(pairs) if pair[::-1] not in pairs[:index]]  # there and back are alike
    seen: Dict[str, Tuple[np.ndarray, float]] = {}
    for name in dict.fromkeys(name for pair in pairs for name in pair):
        seen[name] = greys(bags[name], rounds['image_topic'], every)
    looks = ((COLOURS['blue'], '-', 'map'), (COLOURS['vermillion'], '--', 'drive'))
    handles = [Line2D([], [], color=colour, linestyle=line, label=role) for colour, line, role in looks]
    rows, columns = shape(len(pairs))
    figure, axes = page('Greys in the images of map and drive', rows, columns, 1.9, handles)
    for index, (axis, pair) in enumerate(zip(axes, pairs)):
        for name, (colour, line, _) in zip(pair, looks):
            axis.plot((np.arange(BINS) + .5) * 256 / BINS, 100 * seen[name][0], color=colour, linestyle=line)
        steps = ' and '.join(f'{seen[name][1]:.1f}' for name in pair)
        axis.set(title=literal(f'{pair[0]} → {pair[1]}'), xlim=(0, 256), xlabel=f'grey; from pixel to pixel {steps}',
                 ylabel='' if index % columns else 'share of pixels [%]')
        axis.set_ylim(bottom=0)
    hide_unused(axes, len(pairs))
    return figure


def main() -> int:
    """Exit code 0, or 1 with one line when a file is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--config', type=Path, required=True, help='experiment, YAML')
    parser.add_argument('--rounds', type=Path, required=True, help='folder of the bags')
    parser.add_argument('--output', type=Path, required=True, help='PNG, SVG or PDF to write, by its ending')
    parser.add_argument('--every', type=int, choices=range(1, 1001), default=10, metavar='N',
                        help='one image of N (default: %(default)s)')
    options = parser.parse_args()
    try:
        experiment = read_description(options.config)
        with plt.rc_context(STYLE):
            figure = draw(experiment, options.rounds, options.every)
            with written_whole(options.output) as partial:
                figure.savefig(partial, format=options.output.suffix[1:].lower() or 'png', bbox_inches='tight',
                               pad_inches=.1)
    except DataError as failure:
        print(f'plot_conditions: {failure}', file=sys.stderr)
        return 1
    except (KeyError, TypeError) as failure:
        print(f'plot_conditions: {options.config}: is not an experiment with rounds and pairs: {failure}',
              file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
