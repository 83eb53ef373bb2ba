"""Times as names of files, GPX and cameras have them, and tracks of GPX files."""
import argparse
import calendar
import re
import xml.etree.ElementTree
from decimal import Decimal
from pathlib import Path
from typing import List, NamedTuple, Optional

from evaluation_report.data import DataError

from .recording import Fix, Recording
from .table import exact, text_of

DATE_AND_TIME = re.compile(r'(?<!\d)((?:19|20)\d\d)[-:_]?(0[1-9]|1[0-2])[-:_]?(0[1-9]|[12]\d|3[01])[-_ T]?'
                           r'([01]\d|2[0-3])[-:_.]?([0-5]\d)[-:_.]?([0-5]\d|60)([.,_]?\d{3}|[.,_]\d{1,9})?'
                           r'(Z|[+-]\d\d:?\d\d)?(?!\d)')
# As frame_00_00_21.000 has it: hours, minutes and seconds from the start.
OF_DAY = re.compile(r'(?:^|\D)(\d\d)[_:.-]([0-5]\d)[_:.-]([0-5]\d(?:\.\d{1,9})?)$')
ZONE_NS = 900 * 10**9  # time zones differ by quarters of an hour
LONGEST_OFFSET_S = 14 * 3600


class Moment(NamedTuple):
    """A time; `zoned` when it says to which time zone it belongs."""

    ns: int
    zoned: bool


def moment_of(text: str) -> Optional[Moment]:
    """A date and time in nanoseconds since 1970; without a zone as if it were UTC."""
    found = DATE_AND_TIME.search(text)
    if found is None:
        return None
    *parts, fraction, zone = found.groups()
    seconds = calendar.timegm(tuple(map(int, parts)))
    digits = re.sub(r'\D', '', fraction or '')
    if zone not in (None, 'Z'):
        sign = -1 if zone[0] == '+' else 1
        seconds += sign * (3600 * int(zone[1:3]) + 60 * int(zone[-2:]))
    return Moment(seconds * 10**9 + int(digits.ljust(9, '0')), zone is not None)


def stamp_of_name(stem: str) -> Optional[Decimal]:
    """The number that a name is, or seconds: since 1970 of a date and time, from the start of hours, minutes and
    seconds."""
    date = moment_of(stem)
    if date is not None:
        return Decimal(date.ns) / 10**9
    number = exact(stem)
    if number is not None:
        return number if number >= 0 else None
    day = OF_DAY.search(stem)
    if day is None:
        return None
    return 3600 * int(day.group(1)) + 60 * int(day.group(2)) + Decimal(day.group(3))


def gpx_fixes(path: Path, sigma: Optional[float]) -> List[Fix]:
    """The points of a GPX file that have a time."""
    try:
        root = xml.etree.ElementTree.fromstring(text_of(path))
    except xml.etree.ElementTree.ParseError as error:
        raise DataError(path, f'is not GPX: {error}') from error
    fixes = []
    points = [element for element in root.iter() if element.tag.rpartition('}')[2] in ('trkpt', 'wpt', 'rtept')]
    for index, point in enumerate(points, 1):
        below = {child.tag.rpartition('}')[2]: (child.text or '').strip() for child in point}
        moment = moment_of(below.get('time', ''))
        if moment is None:
            continue
        values = [exact(point.get('lat', '')), exact(point.get('lon', '')), exact(below.get('ele', '0'))]
        for name, value, limit in zip(('lat', 'lon', 'ele'), values, (90, 180, 1e5)):
            if value is None or abs(value) > limit:
                raise DataError(path, f"point {index}: {name} is not a number from {-limit:g} to {limit:g}")
        fixes.append(Fix(moment.ns, *map(float, values), sigma))
    if not fixes:
        raise DataError(path, f'has no point with a time ({len(points)} points without)')
    return fixes


def in_zone_of(fixes: List[Fix], first_ns: int, last_ns: int) -> Optional[int]:
    """What to add to times without a zone, nanoseconds, so that they meet the fixes: whole quarters of an hour, 0 where
    they meet already. None when nothing helps."""
    begin, end = min(fix.stamp_ns for fix in fixes), max(fix.stamp_ns for fix in fixes)
    middle = (begin + end - first_ns - last_ns) // 2
    for shift in (0, (middle + ZONE_NS // 2) // ZONE_NS * ZONE_NS):
        if abs(shift) <= LONGEST_OFFSET_S * 10**9 and first_ns + shift <= end and begin <= last_ns + shift:
            return shift
    return None


def add_gpx(recording: Recording, options: argparse.Namespace, zoned: bool) -> None:
    """Positions of a GPX file. `zoned`: whether the images' times say their time zone; else the whole quarters of an
    hour are guessed with which they meet the track."""
    recording.fixes = gpx_fixes(options.gpx, options.sigma)
    stamps = [image.stamp_ns for image in recording.images]
    first, last = min(stamps), max(stamps)
    shift = in_zone_of(recording.fixes, first, last)
    if shift is None or (zoned and shift != 0):
        track = [fix.stamp_ns for fix in recording.fixes]
        raise DataError(options.gpx, f'is of {when(min(track))} to {when(max(track))}, the images of {when(first)} to '
                        f'{when(last)}: no time in common; --start SECONDS says when the first image was taken')
    if shift != 0:
        recording.notes.append(f'guessed: the clock of the camera is {abs(shift) / 3.6e12:g} h '
                               f'{"behind" if shift > 0 else "ahead of"} that of the track, as of another time zone')
        recording.images = [image._replace(stamp_ns=image.stamp_ns + shift) for image in recording.images]


def when(stamp_ns: int) -> str:
    """A time for a message: seconds since 1970."""
    return f'{stamp_ns / 1e9:.3f} s'
