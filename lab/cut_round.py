#!/usr/bin/python3
"""Copies a stretch of a recorded round into a smaller bag: message by message, bit by bit.

Only the chosen topics and time are kept, and the chunks are compressed; no image is encoded again. With --camera-info,
every image gets a calibration of the same stamp beside it.
"""
import argparse
import struct
from pathlib import Path
from typing import List, Optional, Tuple

import rosbag
import rospy
import package_scripts  # noqa: F401
from camera_info import TOPIC as CAMERA_INFO_TOPIC
from camera_info import read_camera_info
from sensor_msgs.msg import CameraInfo

IMAGE_TOPIC = '/stereo/left/image_raw/compressed'
DEFAULT_TOPICS = [IMAGE_TOPIC, '/gps/fix', '/ground_truth/fix']


def message_stamp(raw: Tuple) -> rospy.Time:
    """That of the header, with which every such message begins: sequence number, seconds, nanoseconds."""
    _, seconds, nanoseconds = struct.unpack_from('<III', raw[1])
    return rospy.Time(seconds, nanoseconds)


def cut(source: Path, target: Path, topics: List[str], start_s: float, duration_s: Optional[float],
        compression: str, camera_info: Optional[CameraInfo] = None) -> int:
    """Copies the messages recorded in [start, start + duration] after the bag's beginning; returns their number."""
    count = 0
    with rosbag.Bag(str(source)) as bag, rosbag.Bag(str(target), 'w', compression=compression) as out:
        begin = rospy.Time.from_sec(bag.get_start_time()) + rospy.Duration.from_sec(start_s)
        end = None if duration_s is None else begin + rospy.Duration.from_sec(duration_s)
        for topic, message, stamp in bag.read_messages(topics, raw=True):
            if (start_s > 0 and stamp < begin) or (end is not None and stamp > end):
                continue
            out.write(topic, message, stamp, raw=True)
            count += 1
            if camera_info is not None and topic == IMAGE_TOPIC:
                camera_info.header.stamp = message_stamp(message)
                out.write(CAMERA_INFO_TOPIC, camera_info, stamp)
                count += 1
    return count


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('source', type=Path, help='bag to read')
    parser.add_argument('target', type=Path, help='bag to write')
    parser.add_argument('--topics', nargs='+', default=DEFAULT_TOPICS, help='topics to keep (default: %(default)s)')
    parser.add_argument('--start', type=float, default=0.0, help='seconds after the beginning (default: 0)')
    parser.add_argument('--duration', type=float, help='seconds to keep (default: to the end)')
    parser.add_argument('--camera-info', type=Path, help='calibration, YAML, to add beside the images')
    parser.add_argument('--compression', choices=['none', 'bz2', 'lz4'], default='bz2', help='of the chunks')
    return parser.parse_args()


def main() -> None:
    args = parse_arguments()
    if not args.source.is_file():
        raise SystemExit(f'cut_round: {args.source} does not exist')
    if args.target.resolve() == args.source.resolve():
        raise SystemExit(f'cut_round: {args.target} would overwrite its source')
    camera_info = read_camera_info(args.camera_info) if args.camera_info else None
    count = cut(args.source, args.target, args.topics, args.start, args.duration, args.compression, camera_info)
    if count == 0:
        args.target.unlink()
        raise SystemExit(f'cut_round: {args.source} holds no message of {", ".join(args.topics)} in that time')
    print(f'{args.target}: {count} messages, {args.target.stat().st_size / 1e6:.2f} MB')


if __name__ == '__main__':
    main()
