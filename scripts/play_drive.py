#!/usr/bin/python3
"""Plays a drive to a running localizer, no faster than it answers: on a slow or busy machine more slowly, with no image
dropped.

Begins when the localizer has its map and listens, and when the node of --window is up. Time (/clock) stands while it
waits. At the end it waits until the window is closed, then ends the nodes of --end.
"""
import argparse
import math
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Callable, Dict, List

import rosbag
import rosgraph
import rosnode
import rospy
from nav_msgs.msg import Path as PathMessage
from rosgraph_msgs.msg import Clock

CLOCK_STEP_S = 0.01  # of wall time
MOST_WAIT_S = 10.0   # for the answer to an image; one that is refused has none


class Failure(Exception):
    """What a user can mend; the message is the whole answer."""


class Answers:
    """What the localizer has answered. Thread-safe."""

    def __init__(self, localizer: str):
        try:
            from visual_localization.msg import LocalizationStatus
        except ImportError as error:
            raise Failure('source the setup.bash of the workspace first: no messages of visual_localization') from error
        self._changed = threading.Condition()
        self._newest = rospy.Time()
        self._has_map = False
        self._answers = True
        rospy.Subscriber(f'{localizer}/status', LocalizationStatus, self._on_status)
        rospy.Subscriber(f'{localizer}/map_path', PathMessage, self._on_map)

    def _on_map(self, message: PathMessage) -> None:
        self._has_map = bool(message.poses)

    def _on_status(self, message) -> None:
        if message.best_image < 0:
            return
        with self._changed:
            self._newest = message.header.stamp
            self._answers = True
            self._changed.notify_all()

    def has_map(self) -> bool:
        return self._has_map

    def wait_for(self, stamp: rospy.Time) -> None:
        """Until the image of this stamp is answered. After one that was not, images are not waited for until the next
        answer."""
        with self._changed:
            if self._answers:
                self._answers = self._changed.wait_for(
                    lambda: self._newest >= stamp or rospy.is_shutdown(), MOST_WAIT_S)


class Time:
    """Publishes simulated time, which goes `rate` times as fast as the wall's and stands while held."""

    def __init__(self, rate: float):
        self._publisher = rospy.Publisher('/clock', Clock, queue_size=1000)
        self._rate = rate
        self._now_s = 0.0
        self._wall_s = 0.0

    def start(self, stamp_s: float) -> None:
        self._now_s, self._wall_s = stamp_s, time.monotonic()
        self._publish()

    def hold(self, wait: Callable[[], None]) -> None:
        before_s = time.monotonic()
        wait()
        self._wall_s += time.monotonic() - before_s

    def advance(self, stamp_s: float) -> None:
        """Returns when it is that time."""
        start_s, wall_s = self._now_s, self._wall_s
        while not rospy.is_shutdown():
            due_s = wall_s + (stamp_s - start_s) / self._rate
            left_s = due_s - time.monotonic()
            if left_s <= 0.0:
                break
            time.sleep(min(left_s, CLOCK_STEP_S))
            self._now_s = min(stamp_s, start_s + (time.monotonic() - wall_s) * self._rate)
            self._publish()
        self._now_s, self._wall_s = stamp_s, max(due_s, time.monotonic() - CLOCK_STEP_S)
        self._publish()

    def _publish(self) -> None:
        self._publisher.publish(Clock(rospy.Time.from_sec(self._now_s)))


def listens(node: str) -> bool:
    """Whether a node has subscribed to something beside the time: a window does so once it is up."""
    try:
        subscribers = rosgraph.Master('/play_drive').getSystemState()[1]
        return any(node in nodes and topic not in ('/clock', '/tf', '/tf_static') for topic, nodes in subscribers)
    except (rosgraph.MasterException, OSError):
        return False


def gone(node: str) -> bool:
    """Whether a node has ended, also one that did not say so."""
    try:
        rosgraph.Master('/play_drive').lookupNode(node)
        return not rosnode.rosnode_ping(node, max_count=1, verbose=False)
    except (rosgraph.MasterException, rosnode.ROSNodeException, OSError):
        return True


def wait_until(condition: Callable[[], bool], deadline_s: float) -> bool:
    end = time.monotonic() + deadline_s
    while not condition():
        if rospy.is_shutdown() or time.monotonic() > end:
            return False
        time.sleep(0.2)
    return True


def publishers_of(bag: rosbag.Bag, topics: List[str]) -> Dict[str, rospy.Publisher]:
    """One for each topic; all of the bag when none is named. Latched where the recorded one was."""
    latched = {one.topic for one in bag._get_connections() if one.header.get('latching') in ('1', b'1')}
    count = len(bag.get_type_and_topic_info(topics or None).topics)
    result: Dict[str, rospy.Publisher] = {}
    for topic, raw, _ in bag.read_messages(topics or None, raw=True):
        if topic not in result:
            result[topic] = rospy.Publisher(topic, raw[4], queue_size=100, latch=topic in latched)
        if len(result) == count:
            break
    return result


def play(args: argparse.Namespace, answers: Answers) -> None:
    clock = Time(args.rate)
    with rosbag.Bag(str(args.bag)) as bag:
        publishers = publishers_of(bag, args.topics)
        image_topic = next((topic for topic in (args.image_topic, f'{args.image_topic}/compressed')
                            if topic in publishers), None)
        if image_topic is None:
            raise Failure(f'{args.bag}: holds no message on {args.image_topic}')
        if not wait_until(answers.has_map, args.deadline):
            raise Failure(f'{args.localizer} had no map within {args.deadline:.0f} s')
        if not wait_until(lambda: publishers[image_topic].get_num_connections() > 0, args.deadline):
            raise Failure(f'nobody listens to {image_topic}')
        if args.window and not wait_until(lambda: listens(args.window), args.deadline):
            print(f'play_drive: {args.window} is not up after {args.deadline:.0f} s; playing without', file=sys.stderr)
        started, before = False, None
        for topic, message, stamp in bag.read_messages(list(publishers)):
            if rospy.is_shutdown():
                return
            if topic == image_topic and before is not None:
                clock.hold(lambda: answers.wait_for(before))
            if started:
                clock.advance(stamp.to_sec())
            else:
                clock.start(stamp.to_sec())
                started = True
            publishers[topic].publish(message)
            if topic == image_topic:
                before = message.header.stamp
        if before is not None:
            answers.wait_for(before)


def end(args: argparse.Namespace) -> None:
    if args.window and not gone(args.window):
        print(f'play_drive: the drive has ended; close the window of {args.window} to end', flush=True)
        wait_until(lambda: gone(args.window), math.inf)
    rosnode.kill_nodes([node for node in args.end if not gone(node)])
    if args.end_launch:
        os.kill(os.getppid(), signal.SIGINT)


def positive(text: str) -> float:
    number = float(text)
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f'{text} is not above 0')
    return number


def parse_arguments() -> argparse.Namespace:
    """Command line without what roslaunch adds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bag', type=Path, required=True)
    parser.add_argument('--rate', type=positive, default=1.0, help='speed at most, of recording (default: %(default)s)')
    parser.add_argument('--image-topic', default='/stereo/left/image_raw', help='without the suffix of a transport')
    parser.add_argument('--topics', nargs='+', default=[], help='play these alone (default: all)')
    parser.add_argument('--localizer', default='/localizer', help='name of the node (default: %(default)s)')
    parser.add_argument('--window', default='', metavar='NODE', help='begin when it is up, stay until it is closed')
    parser.add_argument('--end', nargs='+', default=[], metavar='NODE', help='nodes to end then')
    parser.add_argument('--end-launch', action='store_true',
                        help='end the roslaunch that started this: one with a master of its own goes on without nodes')
    parser.add_argument('--deadline', type=positive, default=120.0, help='seconds to wait for each (default: 120)')
    return parser.parse_args(rospy.myargv()[1:])


def main() -> int:
    """Plays the bag; 1 when it cannot be played."""
    args = parse_arguments()
    rospy.init_node('play_drive', anonymous=True, disable_rosout=True)
    try:
        play(args, Answers(args.localizer))
        end(args)
    except Failure as failure:
        print(f'play_drive: {failure}', file=sys.stderr)
        return 1
    except (OSError, rosbag.ROSBagException) as error:
        print(f'play_drive: {args.bag}: cannot be played: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
