#!/usr/bin/python3
"""Copies a bag with wheel odometry on /odom, for measurements: that of a robot that drove the true positions.

The wheels err as in make_round_bag.py (wheel_odometry.py). A covered camera, slipping wheels and a faster robot show
what odometry is worth, and what it does when it is wrong. Times count from the first image.
"""
import argparse
import sys
from pathlib import Path
from typing import Iterator, List, Optional, Tuple

import cv2
import genpy
import numpy as np
import rosbag
import package_scripts  # noqa: F401
from local_frame import LocalFrame
from wheel_odometry import TOPIC, events

Span = Optional[Tuple[float, float]]


def covered(message, rng: np.random.Generator):
    """The same image with the lens cap on: noise."""
    image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_GRAYSCALE)
    dark = np.clip(rng.normal(8, 2, image.shape), 0, 255).astype(np.uint8)
    message.data = cv2.imencode('.png', dark)[1].tobytes()
    message.format = 'png'
    return message


def is_in(span: Span, time_s: float) -> bool:
    return span is not None and span[0] <= time_s < span[1]


def slipped(odometry: List[tuple], start: float, span: Span) -> Iterator[tuple]:
    """The wheels turn four times as far as the robot goes; what follows goes on from there."""
    last, extra = None, np.zeros(2)
    for stamp, topic, message in odometry:
        position = message.pose.pose.position
        here = np.array((position.x, position.y))
        if last is not None and is_in(span, stamp - start):
            extra = extra + 3 * (here - last)
        last = here
        position.x, position.y = here + extra
        yield stamp, topic, message


def write(options: argparse.Namespace) -> int:
    """Writes the copy; how many images it has."""
    rng = np.random.default_rng(options.seed)
    with rosbag.Bag(str(options.bag)) as bag, rosbag.Bag(str(options.output), 'w') as copy:
        fixes = np.array([(message.header.stamp.to_sec(), message.latitude, message.longitude)
                          for _, message, _ in bag.read_messages([options.truth_topic])])
        if len(fixes) < 2:
            raise ValueError(f'{options.bag}: there is nothing on {options.truth_topic}')
        frame = LocalFrame({'latitude_deg': fixes[0, 1], 'longitude_deg': fixes[0, 2], 'east_m': 0, 'north_m': 0})
        positions = np.column_stack((frame.position(fixes[:, 1], fixes[:, 2]), np.zeros(len(fixes))))
        for stamp, topic, message in slipped(events(fixes[:, 0], positions, rng), fixes[0, 0], options.slip):
            message.header.stamp = genpy.Time.from_sec(stamp)
            copy.write(topic, message, message.header.stamp)
        images = 0
        for topic, message, stamp in bag.read_messages():
            if topic == TOPIC:  # two sets of wheels contradict each other
                continue
            if 'image' in topic:
                images += 1
                if (images - 1) % options.every:
                    continue
                if is_in(options.cover, message.header.stamp.to_sec() - fixes[0, 0]):
                    message = covered(message, rng)
            copy.write(topic, message, stamp)
    return images


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n', maxsplit=1)[0])
    parser.add_argument('--bag', type=Path, required=True, help='recording with compressed images')
    parser.add_argument('--output', type=Path, required=True, help='bag to write')
    parser.add_argument('--truth-topic', default='/ground_truth/fix', help='sensor_msgs/NavSatFix')
    parser.add_argument('--cover', type=float, nargs=2, metavar=('FROM', 'TO'), help='the camera is covered, s')
    parser.add_argument('--slip', type=float, nargs=2, metavar=('FROM', 'TO'), help='the wheels slip, s')
    parser.add_argument('--every', type=int, default=1, help='keep every Nth image: a faster robot')
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    try:
        images = write(options)
    except (OSError, ValueError, rosbag.ROSBagException) as error:
        print(f'add_odometry.py: {error}', file=sys.stderr)
        return 1
    print(f'{options.output}: {images} images before every {options.every}., odometry on {TOPIC}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
