"""What a recording consists of, and the bag that it becomes."""
import copy
import heapq
import io
import sys
import time
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Iterator, List, NamedTuple, Optional, Tuple

import cv2
import genpy
import numpy as np
import PIL.Image
import rosbag
from evaluation_report.data import DataError
from evaluation_report.files import written_whole
from geometry_msgs.msg import PoseStamped, Quaternion, TransformStamped, Vector3
from sensor_msgs.msg import CameraInfo, CompressedImage, NavSatFix, NavSatStatus
from tf2_msgs.msg import TFMessage

IMAGES, CALIBRATION = '/stereo/left/image_raw/compressed', '/stereo/left/camera_info'
FIXES, POSES, FRAMES = '/gps/fix', '/ground_truth/pose', '/tf_static'
# Of x ahead, y left, z up, the axes of an image: x to the right, y down, z ahead.
BODY_FROM_OPTICAL = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
ENDINGS = ('.jpg', '.jpeg', '.png', '.pgm', '.ppm', '.bmp', '.tif', '.tiff')
MOST_BYTES = 256 << 20  # of an image's file
MOST_PIXELS = 4096 * 4096  # as the other programs take
LAST_STAMP_NS = (2**32 - 1) * 10**9  # a ROS stamp has 32 bits of seconds
ENCODINGS = {('uint8', 1): 'mono8', ('uint8', 3): 'bgr8', ('uint16', 1): 'mono16', ('uint16', 3): 'bgr16'}


class Image(NamedTuple):
    """A file and when it was taken."""

    stamp_ns: int
    path: Path


class Fix(NamedTuple):
    """A position, degrees and metres; sigma of the horizontal position, None when nobody knows."""

    stamp_ns: int
    latitude: float
    longitude: float
    altitude: float
    sigma_m: Optional[float]


@dataclass
class Recording:
    """Images, positions, and what is known about the camera."""

    images: List[Image]
    fixes: List[Fix]
    calibration: Optional[CameraInfo] = None
    poses: List[PoseStamped] = field(default_factory=list)  # of the camera: x ahead, y left, z up
    notes: List[str] = field(default_factory=list)  # what was assumed


def require_inside(path: Path, folder: Path, allow_outside: bool) -> None:
    """Whoever made the recording must not choose what else of this machine comes into the bag."""
    if not allow_outside and folder.resolve() not in path.resolve().parents:
        raise DataError(path, f'lies outside of {folder}: --allow-outside takes it')


def image_files(folder: Path, allow_outside: bool) -> List[Path]:
    """The images of a folder by name."""
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() in ENDINGS and path.is_file())
    except OSError as error:
        raise DataError(folder, f'cannot be read: {error.strerror}') from error
    if not files:
        raise DataError(folder, f'holds no image ({" ".join(ENDINGS)})')
    for path in files:
        require_inside(path, folder, allow_outside)
    return files


def require_pixels(path: Path, width: int, height: int, narrower: Optional[int]) -> None:
    """What becomes `narrower` may be larger."""
    most = MOST_PIXELS * (8 if narrower is not None else 1)
    if not 0 < width * height <= most:
        raise DataError(path, f'is {width} x {height}, at most {most} pixels are read'
                        + ('' if narrower is not None else '; more with --width PX'))


def require_size(path: Path, data: bytes, narrower: Optional[int]) -> None:
    """By the header alone: what is larger is never decoded."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            with PIL.Image.open(io.BytesIO(data)) as image:
                width, height = image.size
    except PIL.Image.DecompressionBombError as error:
        raise DataError(path, f'is too large: {error}') from error
    except Exception as error:  # pylint: disable=broad-except  # whatever a broken file leads to
        raise DataError(path, 'is not an image' if data else 'is empty') from error
    require_pixels(path, width, height, narrower)


def resized(pixels: np.ndarray, width: Optional[int]) -> np.ndarray:
    """At most so wide, of the same shape."""
    if width is None or pixels.shape[1] <= width:
        return pixels
    return cv2.resize(pixels, (width, max(1, round(pixels.shape[0] * width / pixels.shape[1]))),
                      interpolation=cv2.INTER_AREA)


def image_message(path: Path, width: Optional[int]) -> Tuple[CompressedImage, Tuple[int, int]]:
    """The file as it is if it is JPEG or PNG and not wider than `width`, pixels; else encoded anew. And its width and
    height."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise DataError(path, f'{path.stat().st_size / 2**20:.0f} MiB, at most {MOST_BYTES >> 20} are read')
        data = path.read_bytes()
    except OSError as error:
        raise DataError(path, f'cannot be read: {error.strerror}') from error
    require_size(path, data, width)
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise DataError(path, 'is not an image that OpenCV reads')
    kind = 'jpeg' if data.startswith(b'\xff\xd8') else 'png'
    transparent = pixels.ndim == 3 and pixels.shape[2] == 4
    if transparent:
        pixels = pixels[:, :, :3]
    encoding = ENCODINGS.get((str(pixels.dtype), 1 if pixels.ndim == 2 else pixels.shape[2]))
    if encoding is None:
        raise DataError(path, f'has pixels of type {pixels.dtype}: 8 or 16 bits, grey or colour, are read')
    smaller = resized(pixels, width)
    if transparent or smaller is not pixels or (kind == 'png' and not data.startswith(b'\x89PNG')):
        pixels, ending = smaller, '.jpg' if kind == 'jpeg' else '.png'
        data = cv2.imencode(ending, pixels, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    message = CompressedImage(format=f'{encoding}; {kind} compressed {encoding if encoding.startswith("bgr") else ""}',
                              data=data)
    message.header.frame_id = 'stereo_left'
    return message, (pixels.shape[1], pixels.shape[0])


def fix_message(fix: Fix) -> NavSatFix:
    """A fix whose covariance is unknown unless somebody said it."""
    message = NavSatFix(latitude=fix.latitude, longitude=fix.longitude, altitude=fix.altitude)
    message.header.frame_id = 'gps'
    message.status.status, message.status.service = NavSatStatus.STATUS_FIX, NavSatStatus.SERVICE_GPS
    if fix.sigma_m is not None:
        variance = fix.sigma_m**2
        message.position_covariance = [variance, 0, 0, 0, variance, 0, 0, 0, 4 * variance]
        message.position_covariance_type = NavSatFix.COVARIANCE_TYPE_APPROXIMATED
    return message


def image_events(recording: Recording, width: Optional[int]) -> Iterator[tuple]:
    """Each image with the calibration beside it."""
    size, shown = None, time.monotonic()
    for index, image in enumerate(recording.images):
        message, this_size = image_message(image.path, width)
        if size not in (None, this_size):
            raise DataError(image.path, f'is {this_size[0]} x {this_size[1]}, the images before are '
                            f'{size[0]} x {size[1]}')
        size = this_size
        yield image.stamp_ns, 0, IMAGES, message
        if recording.calibration is not None:
            info = copy.deepcopy(recording.calibration)
            if info.width == 0:  # KITTI's files do not say it
                info.width, info.height = size
            if width is not None and info.width > width == size[0]:
                scale(info, size)
            if (info.width, info.height) != size:
                raise DataError(image.path, f'is {size[0]} x {size[1]}, the calibration is for '
                                f'{info.width} x {info.height}')
            yield image.stamp_ns, 1, CALIBRATION, info
        if sys.stderr.isatty() and time.monotonic() - shown > 0.5:
            shown = time.monotonic()
            print(f'\r{index + 1} of {len(recording.images)} images', end='', file=sys.stderr)
    if sys.stderr.isatty():
        print('\r\033[K', end='', file=sys.stderr)


def quaternion(rotation: np.ndarray) -> Quaternion:
    """Of a 3 x 3 matrix."""
    turn = cv2.Rodrigues(rotation)[0].ravel()
    half = np.linalg.norm(turn) / 2
    axis = turn * (np.sin(half) / (2 * half) if half > 0 else 0.5)
    return Quaternion(*axis, np.cos(half))


def scale(info: CameraInfo, size: Tuple[int, int]) -> None:
    """The calibration of the same camera for images of another size."""
    for matrix, columns in ((info.K, 3), (info.P, 4)):
        scaled = list(matrix)
        for row, factor in enumerate((size[0] / info.width, size[1] / info.height)):
            for column in range(columns):
                scaled[row * columns + column] *= factor
            scaled[row * columns + 2] += (factor - 1) / 2  # pixels count from their centres
        matrix[:] = scaled
    info.width, info.height = size


def mounting(pose: List[float]) -> TFMessage:
    """The camera on the robot, and the antenna at the robot's origin. `pose`: x y z yaw pitch roll, m and rad, of a
    camera whose x points ahead."""
    x, y, z, yaw, pitch, roll = pose
    turn = np.eye(3)
    for axis, angle in (((0, 0, 1), yaw), ((0, 1, 0), pitch), ((1, 0, 0), roll)):
        turn = turn @ cv2.Rodrigues(np.array(axis, float) * angle)[0]
    message = TFMessage()
    for frame, place, rotation in (('stereo_left', (x, y, z), turn @ BODY_FROM_OPTICAL), ('gps', (0, 0, 0), np.eye(3))):
        link = TransformStamped(child_frame_id=frame)
        link.header.frame_id = 'base_link'
        link.transform.translation = Vector3(*place)
        link.transform.rotation = quaternion(rotation)
        message.transforms.append(link)
    return message


def write_bag(recording: Recording, output: Path, width: Optional[int], mount: Optional[List[float]]) -> str:
    """Writes the messages in the order of their stamps; says what there is. `width`: of the widest image, pixels.
    `mount`: see mounting()."""
    recording.images.sort()
    for before, after in zip(recording.images, recording.images[1:]):
        if before.stamp_ns == after.stamp_ns:
            raise DataError(after.path, f'has the stamp of {before.path.name}, {after.stamp_ns / 1e9:.9f} s')
    stamps = [item.stamp_ns for item in (*recording.images, *recording.fixes)]
    if not 0 < min(stamps) <= max(stamps) <= LAST_STAMP_NS:
        raise DataError(output, f'stamps from {min(stamps) / 1e9:.9g} to {max(stamps) / 1e9:.9g} s: a bag holds those '
                        'after 0 and before 4294967296; --start SECONDS moves them')
    fixes = ((fix.stamp_ns, 2, FIXES, fix_message(fix)) for fix in sorted(recording.fixes))
    poses = ((pose.header.stamp.to_nsec(), 3, POSES, pose) for pose in recording.poses)
    with written_whole(output) as partial:
        try:
            with rosbag.Bag(str(partial), 'w') as bag:
                if mount is not None:
                    start = genpy.Time(*divmod(min(stamps), 10**9))
                    bag.write(FRAMES, mounting(mount), start)
                for stamp_ns, _, topic, message in heapq.merge(image_events(recording, width), fixes, poses,
                                                               key=lambda event: event[:2]):
                    message.header.stamp = genpy.Time(*divmod(stamp_ns, 10**9))
                    bag.write(topic, message, message.header.stamp)
        except rosbag.ROSBagException as error:
            raise DataError(output, f'cannot be written: {error}') from error
    first, last = recording.images[0].stamp_ns, recording.images[-1].stamp_ns
    calibration = 'with' if recording.calibration is not None else 'without'
    return '\n'.join([f'{output}: {len(recording.images)} images in {(last - first) / 1e9:.1f} s, '
                      f'{len(recording.fixes)} fixes, {calibration} calibration', *recording.notes])
