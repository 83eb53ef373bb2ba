#!/usr/bin/python3
"""Turns the positions of a recorded round about a point: the images stay, the route lies otherwise in the map frame.

What confines particles to a box, or limits speeds by axis, depends on how a route lies. Every NavSatFix is turned.
"""
import argparse
import math
from pathlib import Path

import rosbag
import package_scripts  # noqa: F401
from local_frame import metres_per_degree


def turn(source: Path, target: Path, degrees: float, about: list) -> int:
    """Writes `target`; counter-clockwise about latitude and longitude. Returns the number of fixes."""
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    east_m, north_m = metres_per_degree(about[0])
    count = 0
    with rosbag.Bag(str(source)) as bag, rosbag.Bag(str(target), 'w') as out:
        for topic, message, stamp in bag.read_messages():
            if message._type == 'sensor_msgs/NavSatFix':
                east, north = (message.longitude - about[1]) * east_m, (message.latitude - about[0]) * north_m
                message.longitude = about[1] + (cosine * east - sine * north) / east_m
                message.latitude = about[0] + (sine * east + cosine * north) / north_m
                count += 1
            out.write(topic, message, stamp)
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('source', type=Path, help='bag to read')
    parser.add_argument('target', type=Path, help='bag to write')
    parser.add_argument('--degrees', type=float, default=30.0, help='counter-clockwise (default: %(default)s)')
    parser.add_argument('--about', type=float, nargs=2, required=True, metavar=('LATITUDE', 'LONGITUDE'),
                        help='degrees; the same for all rounds of an experiment')
    args = parser.parse_args()
    if not args.source.is_file():
        raise SystemExit(f'turn_round: {args.source} does not exist')
    if args.target.resolve() == args.source.resolve():
        raise SystemExit(f'turn_round: {args.target} would overwrite its source')
    print(f'{args.target}: {turn(args.source, args.target, args.degrees, args.about)} fixes turned')


if __name__ == '__main__':
    main()
