"""The forms in which people publish recordings."""
import argparse
import re
from decimal import Decimal
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Optional, Tuple

from evaluation_report.data import DataError
from local_frame import geodetic

from .recording import Fix, Image, Recording, image_files, require_inside
from .table import Row, Table, exact, text_of
from .times import stamp_of_name

FARTHEST_M = 1e5  # from the datum: the map is a plane
LARGEST_SIGMA_M = 1e4
LAST_NUMBER = 10**9
LARGEST_STAMP = 1e20
DEFAULT_START_S = 1300000001
# A stamp's unit by its size: seconds since 1970 have ten digits. Smaller ones count from the start of the recording.
UNITS = ((1e8, 's from the start', 10**9), (1e11, 's', 10**9), (1e14, 'ms', 10**6), (1e17, 'us', 10**3),
         (float('inf'), 'ns', 1))

class Clock(NamedTuple):
    """How stamps are written."""

    unit: str
    factor: int  # nanoseconds
    start_ns: int  # of stamps that count from the start of the recording

    def ns(self, stamp: Decimal) -> int:
        return int((stamp * self.factor).to_integral_value()) + self.start_ns


def clock_of(largest: Decimal, options: argparse.Namespace) -> Clock:
    """By the largest stamp."""
    unit, factor = next((unit, factor) for limit, unit, factor in UNITS if largest < limit)
    return Clock(unit, factor, start_ns(options) if largest < UNITS[0][0] else 0)


def start_ns(options: argparse.Namespace) -> int:
    return int(Decimal(options.start or DEFAULT_START_S) * 10**9)


def natural(path: Path) -> Tuple:
    """For names in the order of the numbers in them: 9 before 10."""
    return tuple((part.isdigit(), int(part) if part.isdigit() else part) for part in re.split('([0-9]+)', path.name))


def number_of(path: Path) -> int:
    """The last number in a file's name."""
    digits = re.findall('[0-9]+', path.stem)
    if not digits or len(digits[-1]) > 12 or int(digits[-1]) > LAST_NUMBER:
        raise DataError(path, f'has no number from 0 to {LAST_NUMBER} in its name')
    return int(digits[-1])


def numbered(folder: Path, options: argparse.Namespace) -> Dict[int, Path]:
    """The images of a folder by their numbers."""
    files: Dict[int, Path] = {}
    for path in image_files(folder, options.allow_outside):
        number = number_of(path)
        if number in files:
            raise DataError(path, f'and {files[number].name} both have the number {number}; where names are times, use '
                            'photos or csv; where only their order counts, csv with a table in that order')
        files[number] = path
    return dict(sorted(files.items()))


class Positions:
    """Two columns of a table, or two numbers of a file, as a fix."""

    def __init__(self, table: Table, options: argparse.Namespace):
        self.options = options
        found = [[table.find(name) for name in pair] for pair in (('latitude', 'longitude'), ('east', 'north'))]
        whole = [None not in pair for pair in found]
        if not any(whole) and table.header is None and table.width == 2:
            found[1], whole[1] = [0, 1], True
        if whole[0] == whole[1]:
            reason = 'columns of both' if whole[0] else 'no columns of'
            header = f' (columns: {", ".join(table.header)})' if table.header else ' (no header)'
            raise DataError(table.path, f'{reason} latitude and longitude{" and" if whole[0] else ", nor of"} east and '
                            f'north{header}: say which by --column latitude=NAME --column longitude=NAME, or east and '
                            'north')
        self.degrees = whole[0]
        self.pair = found[0] if self.degrees else found[1]
        self.height = table.find('altitude') if self.degrees else table.find('up')
        self.sigma = table.find('sigma')

    def fix(self, row: Row, stamp_ns: int) -> Optional[Fix]:
        """The position of a row; None where it is blank."""
        if all(row.is_empty(column) for column in self.pair):
            return None
        limits = (90.0, 180.0) if self.degrees else (FARTHEST_M, FARTHEST_M)
        values = []
        for column, scale, limit in zip(self.pair, self.options.scale, limits):
            bound = limit / abs(scale)
            values.append(scale * row.number(column, -bound, bound, '' if scale != 1 else
                                             'degrees' if self.degrees else 'm'))
        height = 0.0
        if self.height is not None and not row.is_empty(self.height):
            height = row.number(self.height, -1e4, 1e5, 'm')
        sigma = self.options.sigma
        if self.sigma is not None and not row.is_empty(self.sigma):
            sigma = row.number(self.sigma, 1e-4, LARGEST_SIGMA_M, 'm')
        if self.degrees:
            return Fix(stamp_ns, values[0], values[1], height, sigma)
        return metric_fix(stamp_ns, (values[0], values[1], height), sigma, self.options)


def metric_fix(stamp_ns: int, place: Tuple[float, float, float], sigma: Optional[float],
               options: argparse.Namespace) -> Fix:
    """East, north and up of the datum as a fix."""
    return Fix(stamp_ns, *geodetic(options.datum, *place), sigma)


def by_number(files: Dict[int, Path], options: argparse.Namespace,
              fix_of: Callable[[int, int], Optional[Fix]]) -> Recording:
    """Images at a constant rate; `fix_of`: the position of a number at a stamp."""
    recording = Recording([], [])
    first = next(iter(files))
    for number, path in files.items():
        stamp_ns = start_ns(options) + int((number - first) * Decimal(options.period) * 10**9)
        recording.images.append(Image(stamp_ns, path))
        fix = fix_of(number, stamp_ns)
        if fix is not None:
            recording.fixes.append(fix)
    recording.notes.append(f'stamps: {options.period} s from number to number')
    return recording


def numbered_images(options: argparse.Namespace) -> Recording:
    """Gardens Point and others: the number of an image is its place."""
    files = numbered(options.source, options)
    if options.spacing is not None:
        return by_number(files, options, lambda number, stamp_ns: metric_fix(
            stamp_ns, (number * options.spacing, 0.0, 0.0), options.sigma, options))
    table = Table(options.positions, options.column)
    positions, column = Positions(table, options), table.find('number')
    rows: Dict[int, Row] = {}
    for index, row in enumerate(table.rows):
        number = options.first + index if column is None else int(row.number(column, 0, LAST_NUMBER, ''))
        if number in rows:
            raise DataError(table.path, f'lines {rows[number].line} and {row.line} are both of the number {number}')
        rows[number] = row

    def fix_of(number: int, stamp_ns: int) -> Optional[Fix]:
        if number not in rows:
            raise DataError(files[number], f'has the number {number}, {table.path} has {min(rows)} to {max(rows)}'
                            + ('; --first says which the first row is of' if column is None else ''))
        return positions.fix(rows[number], stamp_ns)

    return by_number(files, options, fix_of)


def pose_position(path: Path, options: argparse.Namespace) -> Tuple[float, float]:
    """The two numbers of a pose file that are the position: marked x and y, or by their places in the file."""
    words = re.split(r'[\s,;:=\[\]()]+', text_of(path))
    values = [(word, words[index - 1] if index else '') for index, word in enumerate(words) if exact(word) is not None]
    marked = {label.lower().rsplit('.', 1)[-1]: word for word, label in reversed(values) if exact(label) is None}
    if options.values is None and {'x', 'y'} <= set(marked):
        chosen = [marked['x'], marked['y']]
    else:
        # A matrix of a pose, or a list that begins with the position.
        places = options.values or {12: (4, 8), 16: (4, 8)}.get(len(values), (1, 2))
        if len(values) < max(places) or (options.values is None and len(values) not in (2, 3, 6, 7, 12, 16)):
            raise DataError(path, f'has {len(values)} numbers: 2, 3, 6, 7, 12 or 16 are expected, or x and y by name; '
                            '--values I J says which are the position')
        chosen = [values[place - 1][0] for place in places]
    result = []
    for text, scale in zip(chosen, options.scale):
        value = float(exact(text)) * scale
        if abs(value) > FARTHEST_M:
            raise DataError(path, f'{text[:60]} is not a number from {-FARTHEST_M / abs(scale):g} to '
                            f'{FARTHEST_M / abs(scale):g}')
        result.append(value)
    return result[0], result[1]


def images_with_poses(options: argparse.Namespace) -> Recording:
    """Fast-SeqSLAM and others: beside each image a file of the same name with its pose."""
    files = numbered(options.source, options)
    folder = options.poses or options.source

    def fix_of(number: int, stamp_ns: int) -> Fix:
        pose = next((path for ending in ('.txt', '.pose', '.csv') for path in [folder / (files[number].stem + ending)]
                     if path.exists()), folder / f'{files[number].stem}.txt')
        return metric_fix(stamp_ns, (*pose_position(pose, options), 0.0), options.sigma, options)

    return by_number(files, options, fix_of)


def rows_with_files(table: Table, column: int, options: argparse.Namespace) -> Recording:
    """A row is an image and its position."""
    positions, stamp_column = Positions(table, options), table.find('stamp')
    recording, files, stamps = Recording([], []), [], []
    for row in table.rows:
        path = options.images / row.fields[column].strip()
        if '\0' in row.fields[column] or not path.is_file():
            raise row.refuse(column, f'there is no file {path}')
        require_inside(path, options.images, options.allow_outside)
        files.append(path)
        stamps.append(Decimal(0) if stamp_column is None else row.decimal(stamp_column, 0, LARGEST_STAMP, ''))
    if stamp_column is None:
        clock, stamps = Clock('', 10**9, start_ns(options)), [
            index * Decimal(options.period) for index in range(len(files))]
        recording.notes.append(f'stamps: {options.period} s from row to row')
    else:
        clock = clock_of(max(stamps), options)
        recording.notes.append(f'stamps: {clock.unit}')
    for row, path, stamp in zip(table.rows, files, stamps):
        recording.images.append(Image(clock.ns(stamp), path))
        fix = positions.fix(row, clock.ns(stamp))
        if fix is not None:
            recording.fixes.append(fix)
    return recording


def rows_with_stamps(table: Table, column: int, options: argparse.Namespace) -> Recording:
    """A row is a fix; the images are named by their stamps."""
    positions = Positions(table, options)
    stamps = [row.decimal(column, 0, LARGEST_STAMP, '') for row in table.rows]
    files = image_files(options.images, options.allow_outside)
    names = [stamp_of_name(path.stem) for path in files]
    unnamed = [path for path, name in zip(files, names) if name is None or name >= LARGEST_STAMP]
    if unnamed and len(files) == len(table.rows):
        return rows_in_order(table, files, stamps, options)
    if unnamed:
        raise DataError(unnamed[0], f'is not named by a stamp, and {table.path} has no column of files: say which by '
                        f'--column file=NAME ({len(table.rows)} rows are not in the order of {len(files)} images)')
    clocks = [clock_of(max(values), options) for values in (stamps, names)]
    recording = Recording([Image(clocks[1].ns(stamp), path) for stamp, path in zip(names, files)], [])
    for row, stamp in zip(table.rows, stamps):
        fix = positions.fix(row, clocks[0].ns(stamp))
        if fix is not None:
            recording.fixes.append(fix)
    recording.notes.append(f'stamps: fixes in {clocks[0].unit}, images in {clocks[1].unit}')
    return recording


def rows_in_order(table: Table, files: List[Path], stamps: List[Decimal], options: argparse.Namespace) -> Recording:
    """A row for each image, in the order of their names."""
    positions, clock = Positions(table, options), clock_of(max(stamps), options)
    recording = Recording([], [], notes=['guessed: the rows are those of the images, in the order of their names'])
    for row, path, stamp in zip(table.rows, sorted(files, key=natural), stamps):
        recording.images.append(Image(clock.ns(stamp), path))
        fix = positions.fix(row, clock.ns(stamp))
        if fix is not None:
            recording.fixes.append(fix)
    return recording


def csv_table(options: argparse.Namespace) -> Recording:
    """Anything: a table with the position of each image, or with fixes of their own stamps."""
    table = Table(options.source, options.column)
    if options.images is None:
        options.images = options.source.parent
    file_column, stamp_column = table.find('file'), table.find('stamp')
    if file_column is not None:
        return rows_with_files(table, file_column, options)
    if stamp_column is not None:
        return rows_with_stamps(table, stamp_column, options)
    files = image_files(options.images, options.allow_outside)
    if len(files) != len(table.rows):
        header = f'columns: {", ".join(table.header)}' if table.header else 'no header'
        raise DataError(table.path, f'has neither files nor stamps ({header}): say which by --column file=NAME or '
                        f'--column stamp=NAME ({len(table.rows)} rows are not in the order of {len(files)} images)')
    recording = rows_in_order(table, files, [index * Decimal(options.period) for index in range(len(files))], options)
    recording.notes.append(f'stamps: {options.period} s from row to row')
    return recording
