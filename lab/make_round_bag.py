#!/usr/bin/python3
"""Turns a rendered round (frame_%04d.png and pose.csv) into a bag as a robot would record it.

JPEG images at 1 Hz on /stereo/left/image_raw/compressed, a DGPS at 5 Hz on /gps/fix with the faults of a real
one (noise, slow bias, multipath bends, gaps, stretches without a fix, single spikes), and the exact positions
on /ground_truth/fix for judging. The same seed gives the same faults. With --camera-info, every image has a calibration
on /stereo/left/camera_info beside it.

A round whose pose.csv has roll and pitch (town, meadow), or any with --full, also has the calibration camera.yaml of
its folder, fixes with the height of the camera, its exact pose (x ahead, y left, z up) in the local east-north-up frame
on /ground_truth/pose, and wheel odometry that slips on /odom.
"""
import argparse
import copy
import csv
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, List, Optional, Tuple

import cv2
import numpy as np
import rosbag
import rospy
import package_scripts  # noqa: F401
from camera_info import TOPIC as CAMERA_INFO_TOPIC
from camera_info import read_camera_info
from geometry_msgs.msg import PoseStamped, Quaternion
from local_frame import metres_per_degree
from sensor_msgs.msg import CameraInfo, CompressedImage, NavSatFix, NavSatStatus
from wheel_odometry import events as odometry_events

# Origin of the local east-north frame.
LATITUDE_DEG, LONGITUDE_DEG, ALTITUDE_M = 48.53450, 9.07130, 445.0

STAMP_JITTER_S = .004
GPS_PERIOD_S = .2
GPS_PHASE_S = .07  # fixes do not fall on image stamps
GPS_NOISE_M = .12
FIRST_STAMP_S = 1.0  # after --start

Event = Tuple[float, str, object]


@dataclass
class Round:
    """The rendered images' stamps and poses, seconds, metres east, north and up, and radians by REP 103."""

    stamps: np.ndarray
    east: np.ndarray
    north: np.ndarray
    up: np.ndarray
    roll: np.ndarray
    pitch: np.ndarray
    yaw: np.ndarray
    tilted: bool  # does the file know roll and pitch?


@dataclass
class Track:
    """What the DGPS reports, one entry a fix."""

    stamps: np.ndarray
    east: np.ndarray  # NaN without a fix
    north: np.ndarray
    status: np.ndarray
    variance: np.ndarray
    lost: np.ndarray  # no message at all
    up: Optional[np.ndarray] = None  # None: the ground is level


def to_geodetic(east: float, north: float) -> Tuple[float, float]:
    """Latitude and longitude in degrees; exact to millimetres within a few hundred metres of the origin."""
    east_m, north_m = metres_per_degree(LATITUDE_DEG, ALTITUDE_M)
    return LATITUDE_DEG + north / north_m, LONGITUDE_DEG + east / east_m


def read_round(folder: Path, rng: np.random.Generator) -> Round:
    """Reads pose.csv; the camera's clock jitters."""
    with open(folder / 'pose.csv', newline='', encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    stamps = np.array([float(row['t']) for row in rows]) + rng.normal(0, STAMP_JITTER_S, len(rows))
    columns = [np.array([float(row.get(name, 0)) for row in rows]) for name in ('x', 'y', 'z', 'roll', 'pitch', 'yaw')]
    return Round(stamps, *columns, tilted='roll' in rows[0])


def drive_with_gps(drive: Round, rng: np.random.Generator) -> Track:
    """A DGPS without faults: white noise and a slow bias."""
    stamps = np.arange(GPS_PHASE_S, drive.stamps[-1], GPS_PERIOD_S)
    east = np.interp(stamps, drive.stamps, drive.east)
    north = np.interp(stamps, drive.stamps, drive.north)
    count = len(stamps)
    east = east + rng.normal(0, GPS_NOISE_M, count) + .25 * np.sin(stamps / 40 + rng.uniform(0, 6))
    north = north + rng.normal(0, GPS_NOISE_M, count) + .25 * np.cos(stamps / 33 + rng.uniform(0, 6))
    return Track(stamps, east, north, np.full(count, NavSatStatus.STATUS_GBAS_FIX), np.full(count, .3 ** 2),
                 np.zeros(count, bool))


def add_heights(track: Track, drive: Round, rng: np.random.Generator) -> None:
    """Heights of the ground, twice as noisy as the position."""
    track.up = np.interp(track.stamps, drive.stamps, drive.up) + rng.normal(0, 2 * GPS_NOISE_M, len(track.stamps))


def add_faults(track: Track, end_s: float, rng: np.random.Generator) -> List[str]:
    """Spoils the track; returns what was done, for people."""
    faults = [add_multipath(track, end_s, rng) for _ in range(3)]
    faults += [add_gap(track, end_s, rng) for _ in range(2)]
    faults.append(add_no_fix(track, end_s, rng))
    faults.append(add_spikes(track, rng))
    return faults


def add_multipath(track: Track, end_s: float, rng: np.random.Generator) -> str:
    """The path bends away and comes back, still 'fixed'; only sometimes does the covariance admit it."""
    centre, width = rng.uniform(30, end_s - 30), rng.uniform(8, 16)
    amplitude, direction = rng.uniform(5, 11), rng.uniform(0, 2 * math.pi)
    bend = np.exp(-.5 * ((track.stamps - centre) / (width / 2.5)) ** 2)
    track.east += amplitude * bend * math.cos(direction)
    track.north += amplitude * bend * math.sin(direction)
    track.variance[bend > .1] = 1.2 ** 2 if rng.random() < .5 else .3 ** 2
    return f'multipath bend of {amplitude:.1f} m at {centre:.0f} s'


def add_gap(track: Track, end_s: float, rng: np.random.Generator) -> str:
    """Something hides the sky: no message."""
    centre, width = rng.uniform(25, end_s - 25), rng.uniform(8, 22)
    track.lost |= np.abs(track.stamps - centre) < width / 2
    return f'gap of {width:.0f} s at {centre:.0f} s'


def add_no_fix(track: Track, end_s: float, rng: np.random.Generator) -> str:
    """Messages go on, but say that there is no fix."""
    centre, width = rng.uniform(25, end_s - 25), rng.uniform(6, 12)
    hidden = np.abs(track.stamps - centre) < width / 2
    track.status[hidden] = NavSatStatus.STATUS_NO_FIX
    track.east[hidden] = np.nan
    return f'no fix for {width:.0f} s at {centre:.0f} s'


def add_spikes(track: Track, rng: np.random.Generator) -> str:
    indices = rng.integers(20, len(track.stamps) - 20, 4)
    for index in indices:
        track.east[index] += rng.choice([-1, 1]) * rng.uniform(15, 60)
    return 'spikes at ' + ', '.join(f'{track.stamps[index]:.0f} s' for index in indices)


def make_fix(east: float, north: float, status: int, variance: float, up_variance: float,
             up: float = 0.0) -> NavSatFix:
    fix = NavSatFix()
    fix.header.frame_id = 'gps'
    fix.status.status = status
    fix.status.service = NavSatStatus.SERVICE_GPS
    if math.isnan(east):
        fix.latitude = fix.longitude = fix.altitude = float('nan')
    else:
        fix.latitude, fix.longitude = to_geodetic(east, north)
        fix.altitude = ALTITUDE_M + up
    fix.position_covariance = [variance, 0, 0, 0, variance, 0, 0, 0, up_variance]
    fix.position_covariance_type = NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
    return fix


def make_image(path: Path, index: int, quality: int) -> CompressedImage:
    pixels = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if pixels is None:
        raise SystemExit(f'make_round_bag: cannot read {path}')
    image = CompressedImage()
    image.header.frame_id = 'stereo_left'
    image.header.seq = index
    image.format = 'mono8; jpeg compressed '
    image.data = cv2.imencode('.jpg', pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
    return image


def make_pose(drive: Round, index: int) -> PoseStamped:
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(angle / 2), math.cos(angle / 2)) for angle in (
        drive.roll[index], drive.pitch[index], drive.yaw[index]))
    message = PoseStamped()
    message.header.frame_id = 'enu'
    place = message.pose.position
    place.x, place.y, place.z = float(drive.east[index]), float(drive.north[index]), float(drive.up[index])
    message.pose.orientation = Quaternion(sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                                          cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy)
    return message


def image_events(folder: Path, drive: Round, quality: int, camera_info: Optional[CameraInfo],
                 full: bool, every: int) -> Iterator[Event]:
    """Every image, or every so many, its calibration if there is one, and its exact position and pose, at its stamp."""
    for index, stamp in list(enumerate(drive.stamps))[::every]:
        image = make_image(folder / f'frame_{index:04d}.png', index, quality)
        yield stamp, '/stereo/left/image_raw/compressed', image
        if camera_info is not None:
            yield stamp, CAMERA_INFO_TOPIC, copy.deepcopy(camera_info)
        truth = make_fix(drive.east[index], drive.north[index], NavSatStatus.STATUS_GBAS_FIX, 1e-4, 1e-4,
                         drive.up[index] if full else 0)
        yield stamp, '/ground_truth/fix', truth
        if full:
            yield stamp, '/ground_truth/pose', make_pose(drive, index)


def gps_events(track: Track) -> Iterator[Event]:
    for index in np.flatnonzero(~track.lost):
        variance = track.variance[index]
        fix = make_fix(track.east[index], track.north[index], int(track.status[index]), variance, 4 * variance,
                       0 if track.up is None else track.up[index])
        yield track.stamps[index], '/gps/fix', fix


def write_bag(path: Path, events: List[Event], start_s: float) -> None:
    with rosbag.Bag(str(path), 'w', compression='none') as bag:
        for offset, topic, message in sorted(events, key=lambda event: event[0]):
            stamp = rospy.Time.from_sec(start_s + offset + FIRST_STAMP_S)
            message.header.stamp = stamp
            bag.write(topic, message, stamp)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('round', type=Path, help='folder that render_world.py wrote')
    parser.add_argument('out', type=Path, help='bag to write')
    parser.add_argument('--seed', type=int, default=0, help='of the faults (default: %(default)s)')
    parser.add_argument('--start', type=float, default=1226500000.0, help='unix time (default: %(default).0f)')
    parser.add_argument('--quality', type=int, default=92, help='of the JPEGs (default: %(default)s)')
    parser.add_argument('--camera-info', type=Path, help='calibration of the camera, YAML')
    parser.add_argument('--full', action='store_true', help='calibration, heights, exact poses and odometry, also for '
                        'a round on level ground (others always have them)')
    parser.add_argument('--every', type=int, default=1, choices=range(1, 1001), metavar='N',
                        help='one frame of N, as of `render_world.py --every N` (default: %(default)s)')
    parser.add_argument('--perfect', action='store_true', help='a DGPS without faults')
    return parser.parse_args()


def main() -> None:
    """Reads the round, drives it with a DGPS, writes the bag."""
    args = parse_arguments()
    rng = np.random.default_rng(args.seed)
    drive = read_round(args.round, rng)
    track = drive_with_gps(drive, rng)
    faults = [] if args.perfect else add_faults(track, drive.stamps[-1], rng)
    full = args.full or drive.tilted
    calibration = args.camera_info or (args.round / 'camera.yaml' if full else None)
    if calibration is not None and not calibration.is_file():
        raise SystemExit(f'make_round_bag: {calibration} does not exist; another calibration: --camera-info FILE')
    camera_info = read_camera_info(calibration) if calibration else None
    events = list(image_events(args.round, drive, args.quality, camera_info, full, args.every))
    if full:
        extra = np.random.default_rng([args.seed, 1])  # of its own: the faults stay those of their seed
        add_heights(track, drive, extra)
        events += odometry_events(drive.stamps, np.stack([drive.east, drive.north, drive.up], 1), extra)
    events += gps_events(track)
    write_bag(args.out, events, args.start)
    print(f'{args.out}: {len(drive.stamps[::args.every])} images, {os.path.getsize(args.out) / 1e6:.1f} MB')
    for fault in faults:
        print(f'  {fault}')


if __name__ == '__main__':
    main()
