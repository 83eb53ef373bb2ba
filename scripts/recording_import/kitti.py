"""KITTI's odometry benchmark."""
import argparse
from decimal import Decimal
from pathlib import Path
from typing import List, Tuple

import genpy
import numpy as np
from evaluation_report.data import DataError
from geometry_msgs.msg import PoseStamped, Quaternion
from sensor_msgs.msg import CameraInfo

from .recording import BODY_FROM_OPTICAL, Image, Recording, quaternion
from .sources import FARTHEST_M, LARGEST_STAMP, clock_of, metric_fix, numbered
from .table import exact, text_of

# East, north and up of the axes of a camera that looks north: x to the right, y down, z ahead.
FROM_CAMERA = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])


def rows_of_numbers(path: Path, count: int) -> List[Tuple[int, List[Decimal]]]:
    """The lines of a file of so many numbers each."""
    rows = []
    for line, text in enumerate(text_of(path).rstrip().split('\n'), 1):
        values = [exact(word) for word in text.split()]
        if len(values) != count or None in values:
            raise DataError(path, f"line {line}: '{text.strip()[:60]}' is not {count} number{'s' * (count > 1)}")
        rows.append((line, values))
    return rows


def kitti_camera(path: Path, camera: int) -> Tuple[CameraInfo, np.ndarray]:
    """The camera's calibration, and its position in the frame of camera 0."""
    lines = [line.split() for line in text_of(path).split('\n')]
    words = next((line[1:] for line in lines if line and line[0].rstrip(':') == f'P{camera}'), None)
    values = [exact(word) for word in words or []]
    if len(values) != 12 or None in values:
        raise DataError(path, f'has no line P{camera}: with 12 numbers')
    matrix = np.array(values, float).reshape(3, 4)
    pinhole = matrix[:, :3]
    if not (pinhole[0, 0] > 0 and pinhole[1, 1] > 0 and pinhole[0, 1] == 0 and not pinhole[1, 0]
            and list(pinhole[2]) == [0, 0, 1]):
        raise DataError(path, f'P{camera} is not the projection of a rectified camera')
    info = CameraInfo(distortion_model='plumb_bob', D=[0.0] * 5, K=list(pinhole.ravel()), R=list(np.eye(3).ravel()),
                      P=list(np.column_stack((pinhole, np.zeros(3))).ravel()))
    info.header.frame_id = 'stereo_left'
    return info, -np.linalg.solve(pinhole, matrix[:, 3])


def kitti_pose(line: int, values: List[Decimal], camera: np.ndarray, path: Path) -> Tuple[np.ndarray, Quaternion]:
    """Position of a camera east, north and up, and its attitude: x ahead, y left, z up."""
    matrix = np.array(values, float).reshape(3, 4)
    rotation = matrix[:, :3]
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-2 or np.linalg.det(rotation) < 0:
        raise DataError(path, f'line {line} is not a pose: its columns 1-3, 5-7 and 9-11 are not a rotation')
    place = FROM_CAMERA @ (rotation @ camera + matrix[:, 3])
    if np.abs(place).max() > FARTHEST_M:
        raise DataError(path, f'line {line} is {np.abs(place).max():.3g} m from the first, at most {FARTHEST_M:g} are '
                        'expected')
    return place, quaternion(FROM_CAMERA @ rotation @ BODY_FROM_OPTICAL.T)


def kitti_odometry(options: argparse.Namespace) -> Recording:
    """A sequence of KITTI's odometry benchmark: images, times.txt and calib.txt, and the poses beside the sequences."""
    folder = options.source
    poses_path = options.poses or folder.parent.parent / 'poses' / f'{folder.resolve().name}.txt'
    files = numbered(folder / f'image_{options.camera}', options)
    poses = rows_of_numbers(poses_path, 12)
    notes = []
    if (folder / 'times.txt').exists():
        times = rows_of_numbers(folder / 'times.txt', 1)
    else:
        times = [(line, [Decimal(index) / 10]) for index, (line, _) in enumerate(poses)]
        notes.append('guessed: 10 images a second, since there is no times.txt')
    for path, rows in ((folder / 'times.txt', times), (poses_path, poses)):
        if max(files) >= len(rows):
            raise DataError(path, f'has {len(rows)} lines, the images go to number {max(files)}: at least '
                            f'{max(files) + 1} are expected')
    for line, (stamp,) in times:
        if not 0 <= stamp <= LARGEST_STAMP:
            raise DataError(folder / 'times.txt', f'line {line}: {stamp} s is not from 0 to {LARGEST_STAMP:g} s')
    for (_, (before,)), (line, (after,)) in zip(times, times[1:]):
        if after <= before:
            raise DataError(folder / 'times.txt', f'line {line}: {after} s is not after {before} s')
    calibration, camera = kitti_camera(folder / 'calib.txt', options.camera)
    recording = Recording([], [], calibration, notes=notes)
    clock = clock_of(times[-1][1][0], options)
    for number, path in files.items():
        stamp_ns = clock.ns(times[number][1][0])
        place, attitude = kitti_pose(*poses[number], camera, poses_path)
        recording.images.append(Image(stamp_ns, path))
        recording.fixes.append(metric_fix(stamp_ns, tuple(place), options.sigma, options))
        pose = PoseStamped()
        pose.header.stamp, pose.header.frame_id = genpy.Time(*divmod(stamp_ns, 10**9)), 'enu'
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = map(float, place)
        pose.pose.orientation = attitude
        recording.poses.append(pose)
    return recording
