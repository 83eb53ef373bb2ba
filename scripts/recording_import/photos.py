"""Photographs with a position each, or beside a track."""
import argparse
import re
from pathlib import Path
from typing import List, Optional, Tuple

import PIL.Image
from evaluation_report.data import DataError

from .recording import Fix, Image, Recording, image_files
from .sources import clock_of, natural, start_ns
from .times import Moment, add_gpx, gpx_fixes, moment_of, stamp_of_name

# Tags of EXIF 2.32 and of its directories.
OF_PHOTO, OF_GPS = 0x8769, 0x8825
TIME, FRACTION, ZONE = 0x9003, 0x9291, 0x9011
LATITUDE_SIGN, LATITUDE, LONGITUDE_SIGN, LONGITUDE, ALTITUDE_SIGN, ALTITUDE, SIGMA = 1, 2, 3, 4, 5, 6, 31


def degrees(parts, sign, negative: str) -> Optional[float]:
    """Of degrees, minutes and seconds."""
    try:
        value = sum(float(part) / 60**power for power, part in enumerate(parts))
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return -value if str(sign).strip().upper() == negative else value


def number(value) -> Optional[float]:
    """Of EXIF's fractions, which may be anything."""
    try:
        return float(value)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None


class Photo:
    """What a photograph says of itself."""

    def __init__(self, path: Path):
        try:
            with PIL.Image.open(path) as image:
                exif = image.getexif()
                self._photo, self._gps = dict(exif.get_ifd(OF_PHOTO)), dict(exif.get_ifd(OF_GPS))
        except Exception:  # pylint: disable=broad-except  # a broken file is refused where it is read
            self._photo, self._gps = {}, {}

    def moment(self) -> Optional[Moment]:
        """When it was taken."""
        fraction = re.sub('[^0-9]', '', str(self._photo.get(FRACTION, '')))[:9]
        zone = str(self._photo.get(ZONE, '')).strip('\0 ')
        time = str(self._photo.get(TIME, '')).strip('\0 ')
        return moment_of(time + (f'.{fraction}' if fraction else '') + zone)

    def fix(self, stamp_ns: int, sigma: Optional[float]) -> Optional[Fix]:
        """Where it was taken."""
        gps = self._gps
        latitude = degrees(gps.get(LATITUDE), gps.get(LATITUDE_SIGN), 'S')
        longitude = degrees(gps.get(LONGITUDE), gps.get(LONGITUDE_SIGN), 'W')
        if latitude is None or longitude is None or not (abs(latitude) <= 90 and abs(longitude) <= 180):
            return None
        altitude = number(gps.get(ALTITUDE)) or 0.0
        altitude = altitude if abs(altitude) <= 1e5 else 0.0
        said = number(gps.get(SIGMA))
        return Fix(stamp_ns, latitude, longitude, -altitude if gps.get(ALTITUDE_SIGN) in (1, b'\x01') else altitude,
                   said if sigma is None and said is not None and 1e-4 <= said <= 1e4 else sigma)


def times_of(files: List[Path], photos: List[Photo], options: argparse.Namespace) -> Tuple[List[int], str, bool]:
    """Stamps, what they rest on, and whether they say their time zone."""
    moments = [photo.moment() for photo in photos]
    if None not in moments:
        return [moment.ns for moment in moments], 'EXIF', all(moment.zoned for moment in moments)
    names = [stamp_of_name(path.stem) for path in files]
    if None in names:
        path = next(path for path, moment, name in zip(files, moments, names) if moment is None or name is None)
        raise DataError(path, 'has no time: neither EXIF nor a name that is a stamp, a date and time, or hours, '
                        'minutes and seconds (frame_00_00_21.000)')
    clock = clock_of(max(names), options)
    if clock.start_ns and options.gpx is not None and options.start is None:
        first = min(fix.stamp_ns for fix in gpx_fixes(options.gpx, None))
        clock = clock._replace(start_ns=first - int(min(names) * clock.factor))
        return [clock.ns(name) for name in names], 'names; guessed: the first is of the first point of the track', True
    return [clock.ns(name) for name in names], f'names, {clock.unit}', bool(clock.start_ns)


def photos_folder(options: argparse.Namespace) -> Recording:
    """Photographs of a walk: times and positions by EXIF, or times by names and positions by GPX."""
    files = sorted(image_files(options.source, options.allow_outside), key=natural)
    photos = [Photo(path) for path in files]
    stamps, source, zoned = times_of(files, photos, options)
    if options.start is not None:
        stamps, zoned = [stamp - min(stamps) + start_ns(options) for stamp in stamps], True
    recording = Recording([Image(stamp, path) for stamp, path in zip(stamps, files)], [], notes=[f'times: {source}'])
    if options.gpx is not None:
        add_gpx(recording, options, zoned)
        return recording
    fixes = [photo.fix(stamp, options.sigma) for photo, stamp in zip(photos, stamps)]
    recording.fixes = [fix for fix in fixes if fix is not None]
    if not recording.fixes:
        raise DataError(options.source, f'has no photograph with a position ({len(files)} without): --gpx FILE adds a '
                        'track')
    if len(recording.fixes) < len(files):
        recording.notes.append(f'{len(files) - len(recording.fixes)} of {len(files)} photographs have no position')
    return recording
