#!/usr/bin/python3
"""Records what a running localizer says about the images of a bag, beside the bag's exact positions.

Subscribes to <localizer>/pose, /fix and /status and to /diagnostics, creates the --ready file as soon as the localizer
has its map and all topics are connected, and writes when every image of the bag is accounted for or when nothing
happens any more: one row for each answered image, and beside the track, as JSON, what became of all images of the bag.
Play the bag yourself, after the --ready file is there.
"""
import argparse
import bisect
import csv
import json
import math
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Path as PathMessage
from sensor_msgs.msg import NavSatFix

sys.path.insert(0, str(Path(__file__).resolve().parent))
from local_frame import metres_per_degree  # noqa: E402

try:
    from visual_localization.msg import LocalizationStatus
except ImportError:
    sys.exit('record_track: source the setup.bash of the workspace first: no messages of visual_localization')

COLUMNS = ['stamp', 'east_m', 'north_m', 'yaw_rad', 'latitude_deg', 'longitude_deg', 'state', 'similarity', 'features',
           'comparisons', 'extract_ms', 'match_ms', 'update_ms', 'source', 'inliers', 'reprojection_px', 'sigma_m',
           'sigma_yaw_rad', 'swept', 'true_latitude_deg', 'true_longitude_deg', 'error_m', 'probability', 'off_map', 'reason',
           'best_image', 'matches', 'features_kept', 'threshold', 'unconfirmed', 'rival_image', 'rival_east_m',
           'rival_north_m', 'rival_probability', 'reason_figure', 'reason_east_m', 'reason_north_m', 'mean_grey',
           'latency_ms', 'explanation']
FEATURES = {LocalizationStatus.SIFT: 'SIFT', LocalizationStatus.GLOBAL: 'GLOBAL'}
SAME_STAMP_S = 0.05  # a truth this near to an image belongs to it


def metres_between(latitude1: float, longitude1: float, latitude2: float, longitude2: float) -> float:
    """Distance of two near positions given in degrees, on the WGS84 ellipsoid."""
    east_m, north_m = metres_per_degree(latitude1)
    return math.hypot((longitude2 - longitude1) * east_m, (latitude2 - latitude1) * north_m)


class Truth:
    """Exact positions of a bag by stamp."""

    def __init__(self, bag: Path, topic: str):
        with rosbag.Bag(str(bag)) as file:
            rows = [(message.header.stamp.to_sec(), message.latitude, message.longitude)
                    for _, message, _ in file.read_messages([topic])]
        self._rows = sorted(rows)
        self._stamps = [row[0] for row in self._rows]

    def at(self, stamp: float) -> Optional[Tuple[float, float]]:
        """Latitude and longitude at a stamp, degrees; None when there is no entry for it."""
        after = bisect.bisect_left(self._stamps, stamp)
        near = [row for row in self._rows[max(0, after - 1):after + 1] if abs(row[0] - stamp) < SAME_STAMP_S]
        if not near:
            return None
        return min(near, key=lambda row: abs(row[0] - stamp))[1:]


# In the diagnostics, in the order of Counts.
COUNT_KEYS = ('Received', 'Processed', 'Dropped', 'Late', 'Refused', 'Without a map')


class Counts(NamedTuple):
    """What became of the images that the localizer received, since some moment."""
    received: int
    processed: int
    dropped: int
    late: int
    refused: int
    without_map: int

    def since(self, before: 'Counts') -> 'Counts':
        """What came after `before`."""
        return Counts(*(now - then for now, then in zip(self, before)))

    def settled(self) -> int:
        """Images that have come to an end."""
        return self.processed + self.dropped + self.late + self.refused + self.without_map


def read_counts(message: DiagnosticArray, localizer: str) -> Optional[Counts]:
    """The counts in the localizer's own diagnostics; None in a message about something else."""
    for status in message.status:
        if status.name.lstrip('/') == f'{localizer.lstrip("/")}: images':
            values = {item.key: item.value for item in status.values}
            return Counts(*(int(values[key]) for key in COUNT_KEYS))
    return None


class Recorder:
    """Collects the localizer's messages by the stamp of the image they belong to."""

    def __init__(self, localizer: str):
        self.poses: Dict[rospy.Time, PoseWithCovarianceStamped] = {}
        self.fixes: Dict[rospy.Time, NavSatFix] = {}
        self.statuses: Dict[rospy.Time, LocalizationStatus] = {}
        self.last_change_s: Optional[float] = None
        self._localizer = localizer
        self._has_map = False
        self._before: Optional[Counts] = None
        self._now: Optional[Counts] = None
        self._subscribers = [
            self._subscribe(f'{localizer}/pose', PoseWithCovarianceStamped, self.poses),
            self._subscribe(f'{localizer}/fix', NavSatFix, self.fixes),
            rospy.Subscriber(f'{localizer}/status', LocalizationStatus, self._on_status),
            rospy.Subscriber('/diagnostics', DiagnosticArray, self._on_diagnostics)]
        rospy.Subscriber(f'{localizer}/map_path', PathMessage, self._on_map)

    @staticmethod
    def _subscribe(topic: str, kind: type, store: dict) -> rospy.Subscriber:
        return rospy.Subscriber(topic, kind, lambda message: store.__setitem__(message.header.stamp, message))

    def _on_map(self, message: PathMessage) -> None:
        self._has_map = bool(message.poses)

    def _on_status(self, message: LocalizationStatus) -> None:
        if message.best_image < 0 or message.header.stamp.is_zero():  # no answer to an image: no map, or none came
            return
        self.statuses[message.header.stamp] = message
        self.last_change_s = time.monotonic()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        counts = read_counts(message, self._localizer)
        if counts and counts != self._now:
            self._now = counts
            self.last_change_s = time.monotonic()

    def is_ready(self) -> bool:
        return (self._has_map and self._now is not None
                and all(subscriber.get_num_connections() > 0 for subscriber in self._subscribers))

    def start(self) -> None:
        self._before = self._now
        self.last_change_s = None

    def last_status(self) -> Optional[LocalizationStatus]:
        statuses = dict(self.statuses)
        return statuses[max(statuses)] if statuses else None

    def counts(self) -> Counts:
        """What the localizer has counted since start()."""
        return self._now.since(self._before)


def count_messages(bag: Path, topic: str) -> int:
    with rosbag.Bag(str(bag)) as file:
        return file.get_message_count(topic)


def wait_until_ready(recorder: Recorder, deadline_s: float) -> bool:
    """Waits for the localizer; False when it is not there in time."""
    end = time.monotonic() + deadline_s
    while time.monotonic() < end and not rospy.is_shutdown():
        if recorder.is_ready():
            return True
        time.sleep(0.05)
    return False


def show_progress(recorder: Recorder, expected: int) -> None:
    """One line that renews itself; nothing when nobody looks."""
    status = recorder.last_status()
    if sys.stderr.isatty() and status:
        print(f'\r  {recorder.counts().settled():4d} of {expected} images  {status.state_name:<12}', end='',
              file=sys.stderr, flush=True)


def collect(recorder: Recorder, expected: int, start_deadline_s: float, silence_s: float) -> None:
    """Returns when every image has come to an end in the localizer, or when nothing has happened for a while."""
    begin = time.monotonic()
    while not rospy.is_shutdown() and recorder.counts().settled() < expected:
        show_progress(recorder, expected)
        limit = begin + start_deadline_s if recorder.last_change_s is None else recorder.last_change_s + silence_s
        if time.monotonic() > limit:
            break
        time.sleep(0.1)
    show_progress(recorder, expected)
    if sys.stderr.isatty():
        print(file=sys.stderr)
    time.sleep(0.5)  # pose and fix of the last image may still be on their way


def reason_of(status: LocalizationStatus) -> Dict[str, object]:
    """The columns that say why; what is NaN stays out."""
    reason, has_rival = status.reason, status.rival_image >= 0
    cells = {'probability': status.probability, 'off_map': status.off_map, 'reason': reason.name,
             'best_image': status.best_image, 'matches': status.best_matches, 'features_kept': status.features_kept,
             'threshold': status.min_probability, 'unconfirmed': status.unconfirmed,
             'rival_image': status.rival_image if has_rival else math.nan, 'rival_east_m': status.rival_x,
             'rival_north_m': status.rival_y, 'rival_probability': status.rival_probability,
             'reason_figure': reason.figure, 'reason_east_m': reason.x, 'reason_north_m': reason.y,
             'mean_grey': status.mean_grey, 'latency_ms': status.latency_ms, 'explanation': reason.sentence}
    return {name: value for name, value in cells.items() if value == value}


def row(stamp: rospy.Time, recorder: Recorder, truth: Truth) -> Dict[str, object]:
    """One image's row; what is not known stays empty."""
    status, pose, fix = recorder.statuses[stamp], recorder.poses.get(stamp), recorder.fixes.get(stamp)
    result = {'stamp': f'{stamp.to_sec():.9f}', 'state': status.state_name, 'similarity': status.best_similarity,
              'features': FEATURES.get(status.features, status.features), 'comparisons': status.comparisons,
              'extract_ms': status.extract_ms, 'match_ms': status.match_ms, 'update_ms': status.update_ms,
              'source': status.source_name, 'inliers': status.inliers, 'reprojection_px': status.reprojection,
              'sigma_m': math.hypot(status.sigma_position, status.map_sigma_position),
              'sigma_yaw_rad': math.hypot(status.sigma_heading, status.map_sigma_heading),
              'swept': status.swept}
    result.update(reason_of(status))
    exact = truth.at(stamp.to_sec())
    if exact:
        result['true_latitude_deg'], result['true_longitude_deg'] = exact
    if pose:
        position, q = pose.pose.pose.position, pose.pose.pose.orientation
        result['east_m'], result['north_m'] = position.x, position.y
        result['yaw_rad'] = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
    if fix:
        result['latitude_deg'], result['longitude_deg'] = fix.latitude, fix.longitude
    if fix and exact:
        result['error_m'] = metres_between(*exact, fix.latitude, fix.longitude)
    return result


def write_track(path: Path, rows: List[Dict[str, object]]) -> None:
    partial = path.with_name(path.name + '.partial')
    with open(partial, 'w', newline='', encoding='utf-8') as file:
        writer = csv.DictWriter(file, COLUMNS, restval='')
        writer.writeheader()
        writer.writerows(rows)
    partial.replace(path)


def write_counts(path: Path, in_bag: int, counts: Counts, answered: int) -> None:
    path.write_text(json.dumps({'in_bag': in_bag, 'answered': answered, **counts._asdict()}) + '\n', encoding='utf-8')


def parse_arguments() -> argparse.Namespace:
    """Command line without what roslaunch adds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--bag', type=Path, required=True, help='the bag that will be played')
    parser.add_argument('--output', type=Path, required=True,
                        help='CSV to write; the counts go into the same name with .json')
    parser.add_argument('--ready', type=Path, help='file to create when the bag may be played')
    parser.add_argument('--localizer', default='/localizer', help='name of the node (default: %(default)s)')
    parser.add_argument('--image-topic', default='/stereo/left/image_raw/compressed', help='in the bag')
    parser.add_argument('--truth-topic', default='/ground_truth/fix', help='in the bag')
    parser.add_argument('--deadline', type=float, default=60.0, help='seconds to wait for localizer and first image')
    parser.add_argument('--silence', type=float, default=15.0, help='seconds without a change that end the recording')
    return parser.parse_args(rospy.myargv()[1:])


def main() -> int:
    args = parse_arguments()
    expected = count_messages(args.bag, args.image_topic)
    if expected == 0:
        print(f'record_track: {args.bag} holds no message on {args.image_topic}', file=sys.stderr)
        return 1
    truth = Truth(args.bag, args.truth_topic)
    rospy.init_node('record_track', anonymous=True, disable_signals=True)
    recorder = Recorder(args.localizer)
    if not wait_until_ready(recorder, args.deadline):
        print(f'record_track: {args.localizer} had no map, or no diagnostics, within {args.deadline:.0f} s',
              file=sys.stderr)
        return 1
    recorder.start()
    if args.ready:
        args.ready.touch()
    collect(recorder, expected, args.deadline, args.silence)
    write_track(args.output, [row(stamp, recorder, truth) for stamp in sorted(recorder.statuses)])
    write_counts(args.output.with_suffix('.json'), expected, recorder.counts(), len(recorder.statuses))
    if not recorder.statuses:
        print(f'record_track: {args.localizer} answered none of the {expected} images', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
