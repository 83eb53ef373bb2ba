#!/usr/bin/python3
"""Runs a localizer for as long as a robot does, and shows whether its memory stays flat.

Starts a roscore and localizer.launch of its own, sends the images of a bag round and round, each as soon as the last one
has been answered, and in between relocalizes, loads the map again and switches the features. Writes a row for every
500 images and a plot. No recorded time passes: stamps go on at --interval, however fast the answers come.
"""
import argparse
import csv
import os
import socket
import statistics
import sys
import threading
import time
import xmlrpc.client
from pathlib import Path
from typing import Dict, List, Optional

import matplotlib
matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402 (after the choice of the backend)

import dynamic_reconfigure.client  # noqa: E402
import rosbag  # noqa: E402
import rosgraph  # noqa: E402
import roslaunch  # noqa: E402
import rospy  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import CompressedImage, Image  # noqa: E402
from std_srvs.srv import Empty  # noqa: E402

try:
    from visual_localization.msg import LocalizationStatus
    from visual_localization.srv import LoadMap
except ImportError:
    sys.exit('soak: source the devel/setup.bash of the workspace first: no messages of visual_localization')

NODE = '/localizer'
ROW_EVERY = 500
MIB = 1024.0  # kB
COLUMNS = ['images', 'seconds', 'answered', 'dropped', 'tracking_share', 'latency_ms', 'resident_mib', 'peak_mib',
           'threads', 'open_files']


class Failure(Exception):
    """What a user can mend; the message is the whole answer."""


def read_images(bag: Path, topic: str) -> List[object]:
    """The messages of an image topic, raw or compressed."""
    try:
        with rosbag.Bag(str(bag)) as file:
            known = file.get_type_and_topic_info().topics
            name = topic if topic in known else topic + '/compressed'
            if name not in known:
                raise Failure(f'{bag} has no topic {topic}, only {", ".join(sorted(known))}')
            kind = Image if known[name].msg_type == Image._type else CompressedImage
            images = []
            for _, raw, _ in file.read_messages([name], raw=True):
                images.append(kind().deserialize(raw[1]))
    except (rosbag.ROSBagException, OSError) as error:
        raise Failure(f'{bag}: {error}') from error
    if not images:
        raise Failure(f'{bag} holds no message on {topic}')
    return images


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def launch(port: int, map_file: Path, topic: str, compressed: bool) -> roslaunch.parent.ROSLaunchParent:
    """A master, and the localizer as its launch file starts it."""
    arguments = [f'map:={map_file}', f'image:={topic}',
                 f'image_transport:={"compressed" if compressed else "raw"}']
    file = roslaunch.rlutil.resolve_launch_arguments(['visual_localization', 'localizer.launch'])[0]
    parent = roslaunch.parent.ROSLaunchParent(
        roslaunch.rlutil.get_or_generate_uuid(None, False), [(file, arguments)], is_core=True, port=port,
        roslaunch_strs=['<launch><param name="/use_sim_time" value="true"/></launch>'])
    parent.start()
    return parent


class Process:
    """The figures of the localizer's process."""

    def __init__(self, name: str):
        api = rosgraph.Master('/soak').lookupNode(name)
        pid = xmlrpc.client.ServerProxy(api).getPid('/soak')[2]
        self._folder = Path('/proc') / str(pid)

    def figures(self) -> Dict[str, float]:
        lines = (self._folder / 'status').read_text(encoding='ascii').splitlines()
        fields = {name: value.split() for name, value in (line.split(':', 1) for line in lines)}
        return {'resident_mib': int(fields['VmRSS'][0]) / MIB, 'peak_mib': int(fields['VmHWM'][0]) / MIB,
                'threads': int(fields['Threads'][0]), 'open_files': len(list((self._folder / 'fd').iterdir()))}


class Feeder:
    """Sends images with ever later stamps and reads the answers."""

    def __init__(self, images: List[object], topic: str, interval_s: float):
        self._images = images
        self._interval = rospy.Duration(interval_s)
        self._stamp = rospy.Time(1000)
        self._answered = threading.Condition()
        self._answer: Optional[LocalizationStatus] = None
        self.window: List[LocalizationStatus] = []  # the answers since the last row
        compressed = isinstance(images[0], CompressedImage)
        self._clock = rospy.Publisher('/clock', Clock, queue_size=10)
        self._publisher = rospy.Publisher(topic + ('/compressed' if compressed else ''), type(images[0]), queue_size=1)
        rospy.Subscriber(NODE + '/status', LocalizationStatus, self._on_status, queue_size=100)

    def _on_status(self, message: LocalizationStatus) -> None:
        if message.best_image < 0:
            return
        with self._answered:
            self._answer = message
            self.window.append(message)
            self._answered.notify()

    def is_connected(self) -> bool:
        return self._publisher.get_num_connections() > 0 and self._clock.get_num_connections() > 0

    def send(self, number: int) -> rospy.Time:
        self._stamp += self._interval
        image = self._images[number % len(self._images)]
        image.header.stamp = self._stamp
        self._clock.publish(Clock(self._stamp))
        self._publisher.publish(image)
        return self._stamp

    def wait_for(self, stamp: rospy.Time, timeout_s: float) -> bool:
        with self._answered:
            return self._answered.wait_for(lambda: self._answer is not None and self._answer.header.stamp >= stamp,
                                           timeout_s)

    def last(self) -> Optional[LocalizationStatus]:
        return self._answer


class Disturber:
    """What users do to a localizer while it runs, one thing after the other."""

    def __init__(self, map_file: Path):
        load = rospy.ServiceProxy(NODE + '/load_map', LoadMap)
        relocalize = rospy.ServiceProxy('/global_localization', Empty)
        reconfigure = dynamic_reconfigure.client.Client(NODE, timeout=30)
        self._actions = [relocalize, lambda: self._load(load, map_file),
                         lambda: reconfigure.update_configuration({'features': 'hybrid'}),
                         lambda: reconfigure.update_configuration({'features': 'sift'})]
        self._next = 0

    @staticmethod
    def _load(service, map_file: Path) -> None:
        answer = service(str(map_file))
        if not answer.success:
            raise Failure(f'load_map: {answer.message}')

    def disturb(self) -> None:
        self._actions[self._next % len(self._actions)]()
        self._next += 1


def row_of(images: int, begin: float, feeder: Feeder, process: Process) -> Dict[str, object]:
    """What is written after so many images."""
    window, feeder.window = feeder.window, []
    last = feeder.last()
    times = [status.extract_ms + status.match_ms + status.update_ms for status in window]
    tracking = sum(status.state == LocalizationStatus.TRACKING for status in window)
    return {'images': images, 'seconds': round(time.monotonic() - begin, 1),
            'answered': last.images_processed if last else 0, 'dropped': last.images_dropped if last else 0,
            'tracking_share': round(tracking / max(1, len(window)), 3),
            'latency_ms': round(statistics.median(times), 3) if times else '', **process.figures()}


def run(args: argparse.Namespace, feeder: Feeder, process: Process, disturber: Disturber) -> List[Dict[str, object]]:
    rows, begin = [], time.monotonic()
    for number in range(args.images):
        stamp = feeder.send(number)
        if not feeder.wait_for(stamp, 20.0):
            raise Failure(f'no answer to image {number} within 20 s')
        if (number + 1) % ROW_EVERY == 0:
            rows.append(row_of(number + 1, begin, feeder, process))
            if sys.stderr.isatty():
                print(f'\r  {number + 1} of {args.images} images, {rows[-1]["resident_mib"]:.1f} MiB', end='',
                      file=sys.stderr, flush=True)
        if args.disturb_every and (number + 1) % args.disturb_every == 0:
            disturber.disturb()
    return rows


def write_rows(path: Path, rows: List[Dict[str, object]]) -> None:
    partial = path.with_name(path.name + '.partial')
    with open(partial, 'w', newline='', encoding='utf-8') as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    partial.replace(path)


def plot(rows: List[Dict[str, object]], path: Path, title: str) -> None:
    """Memory, time and state over the images."""
    plt.rcParams.update({'font.size': 9, 'axes.spines.top': False, 'axes.spines.right': False, 'axes.titlesize': 9,
                         'axes.titlelocation': 'left'})
    images = [row['images'] / 1000 for row in rows]
    panels = [('resident memory of the process (MiB)', 'resident_mib'),
              ('extraction, comparisons and tracker, median of 500 images (ms)', 'latency_ms'),
              ('share of TRACKING', 'tracking_share')]
    figure, all_axes = plt.subplots(len(panels), 1, figsize=(8, 6), sharex=True, constrained_layout=True,
                                    gridspec_kw={'height_ratios': [2, 1, 1]})
    figure.suptitle(title, fontsize=10)
    for axes, (name, column) in zip(all_axes, panels):
        axes.plot(images, [row[column] if row[column] != '' else float('nan') for row in rows], color='#1f77b4',
                  linewidth=1)
        axes.set_title(name)
        axes.set_ylim(bottom=0)
        axes.grid(color='#e0e0e0', linewidth=0.5)
    all_axes[-1].set_xlabel('thousands of images')
    figure.savefig(path, dpi=110)


def summary_of(rows: List[Dict[str, object]]) -> str:
    """One line: is it flat?"""
    quarter = max(1, len(rows) // 4)
    second, last = ([row['resident_mib'] for row in part] for part in (rows[quarter:2 * quarter] or rows,
                                                                         rows[-quarter:]))
    return (f'{rows[-1]["images"]} images in {rows[-1]["seconds"]:.0f} s, {rows[-1]["answered"]} answered, '
            f'{rows[-1]["dropped"]} dropped; resident {rows[0]["resident_mib"]:.1f} MiB after {rows[0]["images"]}, '
            f'median {statistics.median(second):.1f} MiB in the second quarter, {statistics.median(last):.1f} MiB in '
            f'the last one, peak {rows[-1]["peak_mib"]:.1f} MiB; {rows[-1]["threads"]} threads, '
            f'{rows[-1]["open_files"]} open files')


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--map', type=Path, required=True, help='map file')
    parser.add_argument('--bag', type=Path, required=True, help='round whose images are sent')
    parser.add_argument('--image-topic', default='/stereo/left/image_raw', help='in the bag, raw or compressed')
    parser.add_argument('--images', type=int, default=200000, help='how many are sent (default: %(default)s)')
    parser.add_argument('--interval', type=float, default=0.4, help='seconds between their stamps')
    parser.add_argument('--disturb-every', type=int, default=2500, metavar='N',
                        help='relocalize, load the map or switch the features every N images; 0: never')
    parser.add_argument('--csv', type=Path, required=True, help='table to write')
    parser.add_argument('--plot', type=Path, help='picture to write')
    return parser.parse_args()


def soak(args: argparse.Namespace) -> List[Dict[str, object]]:
    """The whole run with a ROS of its own."""
    images = read_images(args.bag, args.image_topic)
    port = free_port()
    os.environ.update(ROS_MASTER_URI=f'http://127.0.0.1:{port}', ROS_IP='127.0.0.1')
    parent = launch(port, args.map.resolve(), args.image_topic, isinstance(images[0], CompressedImage))
    try:
        rospy.init_node('soak', disable_signals=True)
        feeder = Feeder(images, args.image_topic, args.interval)
        end = time.monotonic() + 60
        while not feeder.is_connected():
            if time.monotonic() > end:
                raise Failure('the localizer did not start within 60 s')
            time.sleep(0.1)
        rospy.wait_for_service(NODE + '/load_map', 30)
        time.sleep(2)  # the map
        return run(args, feeder, Process(NODE), Disturber(args.map.resolve()))
    finally:
        parent.shutdown()


def main() -> int:
    args = parse_arguments()
    try:
        rows = soak(args)
        if not rows:
            raise Failure(f'--images {args.images} must be at least {ROW_EVERY}')
    except Failure as failure:
        print(f'soak: {failure}', file=sys.stderr)
        return 1
    write_rows(args.csv, rows)
    if args.plot:
        plot(rows, args.plot, f'{rows[-1]["images"]} images of {args.bag.name}, map {args.map.name}')
    print(summary_of(rows))
    return 0


if __name__ == '__main__':
    sys.exit(main())
