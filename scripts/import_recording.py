#!/usr/bin/python3
"""Turns a public data set, a video, photographs, or images with a table of positions, into a bag as a robot records it.

JPEG and PNG images are copied as they are, unless --width makes them smaller. Topics:
/stereo/left/image_raw/compressed, /gps/fix, where the camera is known /stereo/left/camera_info, and with --mount
/tf_static. Metres count from --datum.
"""
import argparse
import math
import signal
import sys
import tempfile
from decimal import Decimal
from pathlib import Path
from typing import Tuple

sys.path.insert(0, str(Path(__file__).resolve().parent))
from camera_info import read_camera_info  # noqa: E402
from evaluation_report.data import DataError, printable  # noqa: E402
from recording_import import kitti, photos, sources, video  # noqa: E402
from recording_import.recording import Recording, write_bag  # noqa: E402
from recording_import.table import MEANINGS, exact  # noqa: E402

EXAMPLES = {
    'kitti_odometry': 'import_recording.py kitti_odometry dataset/sequences/03 --output kitti03.bag',
    'numbered_images': 'import_recording.py numbered_images GardensPoint/day_left --positions gp_pos.csv '
                       '--scale 176 -110 --period 2 --output day_left.bag',
    'images_with_poses': 'import_recording.py images_with_poses UofA/day --values 2 3 --output day.bag',
    'csv': 'import_recording.py csv positions.csv --images images --output drive.bag',
    'photos': 'import_recording.py photos walk --width 640 --output walk.bag',
    'video': 'import_recording.py video GX010001.MP4 --width 640 --output ride.bag',
}
MOUNTS = {'ahead': 0.0, 'left': 0.5, 'back': 1.0, 'right': -0.5}  # directions of view, half turns


def ranged(low: float, high: float):
    """A type for argparse: a number in a range, kept as it is written."""
    def parse(text: str) -> Decimal:
        value = exact(text)
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(f"'{printable(text)}' is not a number from {low:.12g} to {high:.12g}")
        return value
    return parse


def real(low: float, high: float):
    """The same as a float."""
    parse = ranged(low, high)
    return lambda text: float(parse(text))


def factor(text: str) -> float:
    """A scale: not 0."""
    value = real(-1e6, 1e6)(text)
    if abs(value) < 1e-9:
        raise argparse.ArgumentTypeError(f"'{printable(text)}' is too near to 0, from 1e-9 is expected")
    return value


def place_in_file(text: str) -> int:
    """Which of a file's numbers, from 1."""
    if not (text.isascii() and text.isdigit() and 1 <= int(text[:6]) <= 1000):
        raise argparse.ArgumentTypeError(f"'{printable(text)}' is not a whole number from 1 to 1000")
    return int(text)


def pixels(text: str) -> int:
    """A width of images."""
    return int(ranged(16, 8192)(text))


class Mount(argparse.Action):
    """A direction, or six numbers."""

    def __call__(self, parser, namespace, values, option_string=None):
        if len(values) == 1 and values[0] in MOUNTS:
            pose = [0.0, 0.0, 0.0, MOUNTS[values[0]] * math.pi, 0.0, 0.0]
        elif len(values) == 6:
            try:
                pose = [real(-limit, limit)(value) for value, limit in zip(values, 3 * [100] + 3 * [2 * math.pi])]
            except argparse.ArgumentTypeError as error:
                raise argparse.ArgumentError(self, str(error))
        else:
            raise argparse.ArgumentError(self, f"'{printable(' '.join(values))}' is not {', '.join(MOUNTS)}, nor six "
                                         'numbers: x y z yaw pitch roll, m and rad')
        setattr(namespace, self.dest, pose)


def column(text: str) -> Tuple[str, str]:
    """MEANING=COLUMN."""
    meaning, separator, name = text.partition('=')
    if meaning not in MEANINGS or not separator or not name:
        raise argparse.ArgumentTypeError(f"'{printable(text)}' is not MEANING=COLUMN with a meaning of "
                                         f'{", ".join(MEANINGS)}')
    return meaning, name


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with the arguments."""

    def error(self, message: str):
        self.exit(2, f'import_recording: {printable(" ".join(message.split()))}\n')


def common_options() -> argparse.ArgumentParser:
    """What all forms have."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument('--output', type=Path, required=True, help='bag to write')
    parser.add_argument('--camera-info', type=Path, metavar='FILE', help='calibration of the camera, YAML of '
                        'camera_calibration')
    parser.add_argument('--datum', type=str, nargs=3, default=['49.0', '8.4', '200'], metavar=('LAT', 'LON', 'ALT'),
                        help='where metres count from, degrees and metres (default: 49 8.4 200)')
    parser.add_argument('--sigma', type=real(1e-4, 1e4), metavar='M', help='standard deviation of the positions '
                        '(default: not known; KITTI: 0.05)')
    parser.add_argument('--allow-outside', action='store_true', help='take images, too, that lie elsewhere than in '
                        'their folder: by links, .. and absolute paths')
    parser.add_argument('--width', type=pixels, metavar='PX', help='make wider images so wide (default: as they are)')
    parser.add_argument('--mount', nargs='+', action=Mount, metavar='M', help='how the camera looks from the robot: '
                        'ahead, left, back or right, or x y z yaw pitch roll, m and rad, as robot/camera of the map '
                        'builder (default: not known)')
    parser.add_argument('--start', type=ranged(1, 4e9), metavar='S', help='Unix time of the first image where stamps '
                        f'do not say it (default: {sources.DEFAULT_START_S}); of photos and videos in any case')
    return parser


def parser_of_forms() -> Parser:
    """The command line."""
    parser = Parser(prog='import_recording', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
                    epilog='examples:\n' + '\n'.join(f'  {example}' for example in EXAMPLES.values()))
    forms = parser.add_subparsers(dest='form', required=True, metavar='FORM', parser_class=Parser)
    common, table, metric = common_options(), argparse.ArgumentParser(add_help=False), argparse.ArgumentParser(
        add_help=False)
    table.add_argument('--column', type=column, action='append', default=[], metavar='MEANING=COLUMN',
                       help=f'which column, by name or position from 1, is the {", ".join(MEANINGS)}; '
                       'the usual names are known')
    track = argparse.ArgumentParser(add_help=False)
    track.add_argument('--gpx', type=Path, metavar='FILE', help='track of the same walk')
    metric.add_argument('--scale', type=factor, nargs=2, default=[1.0, 1.0], metavar=('A', 'B'),
                        help='factors of the two numbers of a position, to metres or degrees')
    metric.add_argument('--period', type=ranged(1e-3, 1e4), default=Decimal(1), metavar='S',
                        help='from image to image where there are no stamps (default: %(default)s s)')

    def form(name: str, description: str, *parents: argparse.ArgumentParser) -> argparse.ArgumentParser:
        return forms.add_parser(name, help=description, description=description, parents=[common, *parents],
                                epilog=f'example: {EXAMPLES[name]}')

    kitti = form('kitti_odometry', 'sequence of the KITTI odometry benchmark')
    kitti.add_argument('source', type=Path, help='folder of the sequence: image_0 or image_2, times.txt, calib.txt')
    kitti.add_argument('--poses', type=Path, help='poses of camera 0 (default: ../../poses/SEQUENCE.txt)')
    kitti.add_argument('--camera', type=int, choices=range(4), default=0, help='folder image_N (default: %(default)s)')
    numbers = form('numbered_images', 'folder of numbered images, as of Gardens Point', table, metric)
    numbers.add_argument('source', type=Path, help='folder; the last number in a name counts')
    where = numbers.add_mutually_exclusive_group(required=True)
    where.add_argument('--positions', type=Path, metavar='CSV', help='a row for each number; without a header two '
                       'columns, east and north')
    where.add_argument('--spacing', type=real(1e-3, 1e4), metavar='M', help='no positions: so far from number to '
                       'number along a line')
    numbers.add_argument('--first', type=int, default=0, metavar='N', help='number of the first row, without a column '
                         'of numbers (default: %(default)s)')
    poses = form('images_with_poses', 'folder of images, each with a file of its pose, as of Fast-SeqSLAM', metric)
    poses.add_argument('source', type=Path, help='folder; NAME.jpg has its pose in NAME.txt')
    poses.add_argument('--poses', type=Path, metavar='FOLDER', help='of the poses, if another')
    poses.add_argument('--values', type=place_in_file, nargs=2, metavar=('I', 'J'),
                       help='which numbers of the file, from 1, are east and north (default: those marked x and y; of '
                       'a matrix its translation; else the first two)')
    anything = form('csv', 'table with the position of each image, or of fixes with stamps', table, metric)
    anything.add_argument('source', type=Path, help='columns of files or stamps, and of latitude and longitude, or '
                          'east and north')
    anything.add_argument('--images', type=Path, metavar='FOLDER', help='of the images (default: that of the table); '
                          'without a column of files they are named by their stamps')
    walk = form('photos', 'folder of photographs with positions in EXIF, or with a GPX file', track)
    walk.add_argument('source', type=Path, help='folder; times are those of EXIF, or the names: stamps, dates and '
                      'times, or hours, minutes and seconds from the start (frame_00_00_21.000.jpg)')
    film = form('video', 'video of a GoPro with its own track (GPMF), or with a GPX file', track)
    film.add_argument('source', type=Path, help='any video that OpenCV reads; images are kept in a temporary folder')
    film.add_argument('--period', type=ranged(1e-3, 1e4), default=Decimal('0.5'), metavar='S',
                      help='from image to image (default: %(default)s s)')
    return parser


def arguments() -> argparse.Namespace:
    """With values in place of texts."""
    parser = parser_of_forms()
    options = parser.parse_args()
    limits = (('latitude', 90), ('longitude', 180), ('altitude', 1e4))
    try:
        options.datum = [real(-limit, limit)(text) for text, (_, limit) in zip(options.datum, limits)]
    except argparse.ArgumentTypeError as error:
        parser.error(f'argument --datum: {error}')
    options.column = dict(getattr(options, 'column', []))
    if options.form == 'kitti_odometry' and options.sigma is None:
        options.sigma = 0.05
    return options


def read(options: argparse.Namespace) -> Recording:
    """The recording as its form has it."""
    if options.source.suffix in ('.mcap', '.db3'):
        raise DataError(options.source, f'is a bag of ROS 2: rosbags-convert --src {options.source.parent} --dst '
                        f'{options.source.stem}.bag converts the folder of it (pip install rosbags)')
    recording = {'kitti_odometry': kitti.kitti_odometry, 'numbered_images': sources.numbered_images,
                 'images_with_poses': sources.images_with_poses, 'csv': sources.csv_table,
                 'photos': photos.photos_folder, 'video': video.video}[options.form](options)
    if not recording.fixes:
        raise DataError(options.source, 'has no position')
    if options.camera_info is not None:
        try:
            recording.calibration = read_camera_info(options.camera_info)
        except OSError as error:
            raise DataError(options.camera_info, f'cannot be read: {error.strerror}') from error
        except Exception as error:  # pylint: disable=broad-except  # whatever a broken file leads to
            raise DataError(options.camera_info, f'is not a calibration of camera_calibration: {error}') from error
    return recording


def main() -> int:
    """Exit code 0, or 1 with one line when a file is not as it should be."""
    options = arguments()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that what is half written goes
    try:
        with tempfile.TemporaryDirectory(prefix='import_recording.') as options.scratch:
            print(write_bag(read(options), options.output, options.width, options.mount))
        return 0
    except DataError as failure:
        print(f'import_recording: {failure}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == '__main__':
    sys.exit(main())
