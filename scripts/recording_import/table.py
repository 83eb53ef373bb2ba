"""Tables of numbers as people write them: with a header or without, separated by commas, semicolons, tabs or spaces."""
import csv
import re
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional

from evaluation_report.data import DataError

MOST_BYTES = 256 << 20
# What a column means, by the names that it is known by; units in brackets and signs between letters do not count.
MEANINGS = {
    'file': ('file', 'filename', 'image', 'imagename', 'imagefile', 'name', 'path'),
    'stamp': ('stamp', 'stampns', 'timestamp', 'timestampns', 'time', 'times', 't'),
    'number': ('number', 'index', 'id', 'image', 'frame', 'place'),
    'latitude': ('latitude', 'lat', 'latitudedeg'),
    'longitude': ('longitude', 'lon', 'lng', 'long', 'longitudedeg'),
    'altitude': ('altitude', 'alt', 'altitudem', 'height'),
    'east': ('east', 'eastm', 'easting', 'x', 'xm'),
    'north': ('north', 'northm', 'northing', 'y', 'ym'),
    'up': ('up', 'upm', 'z', 'zm'),
    'sigma': ('sigma', 'sigmam', 'accuracy'),
}


def text_of(path: Path) -> str:
    """A text file, of a size that fits into memory."""
    try:
        if not path.is_file():
            raise DataError(path, 'there is no such file' if not path.exists() else 'is not a file')
        if path.stat().st_size > MOST_BYTES:
            raise DataError(path, f'{path.stat().st_size / 2**20:.0f} MiB, at most {MOST_BYTES >> 20} are read')
        return path.read_text(encoding='utf-8-sig')
    except OSError as error:
        raise DataError(path, f'cannot be read: {error.strerror}') from error
    except UnicodeDecodeError as error:
        raise DataError(path, f'is not text in UTF-8 (byte {error.start})') from error


def exact(text: str) -> Optional[Decimal]:
    """A finite decimal number; None for anything else."""
    try:
        value = Decimal(text.strip())
    except InvalidOperation:
        return None
    return value if value.is_finite() and abs(value.adjusted()) < 40 else None


def is_header(fields: List[str]) -> bool:
    """Whether a line names columns: a row of values has a number."""
    return all(exact(field) is None for field in fields)


class Row(NamedTuple):
    """The fields of a line."""

    table: 'Table'
    line: int
    fields: List[str]

    def refuse(self, column: int, what: str) -> DataError:
        """What to raise about a field."""
        return DataError(self.table.path, f'line {self.line}, column {self.table.name(column)}: {what}')

    def decimal(self, column: int, low: float, high: float, unit: str) -> Decimal:
        """A number in its range, with all its digits."""
        value = exact(self.fields[column])
        if value is None or not low <= value <= high:
            shown = self.fields[column].strip()[:60]
            raise self.refuse(column, f"'{shown}' is not a number from {low:g} to {high:g}{unit and ' ' + unit}")
        return value

    def number(self, column: int, low: float, high: float, unit: str) -> float:
        """A number in its range."""
        return float(self.decimal(column, low, high, unit))

    def is_empty(self, column: int) -> bool:
        """Whether the field is blank."""
        return not self.fields[column].strip()


class Table:
    """The rows of a file, all of the same number of fields."""

    def __init__(self, path: Path, columns: Dict[str, str]):
        """`columns`: the name, or the position from 1, of the column of a meaning; it goes before the known names."""
        self.path = path
        lines = [(number, line.strip()) for number, line in enumerate(text_of(path).split('\n'), 1) if line.strip()]
        start = next((index for index, (_, line) in enumerate(lines) if not line.startswith('#')), len(lines))
        data = [line for line in lines[start:] if not line[1].startswith('#')]
        self._separator = next((mark for mark in ',;\t' if data and mark in data[0][1]), None)
        rows = [(number, self._split(number, line)) for number, line in data]
        self.header = None
        if rows and is_header(rows[0][1]):
            self.header = rows.pop(0)[1]
        elif rows and start > 0:  # a header may be a comment
            fields = self._split(lines[start - 1][0], lines[start - 1][1].lstrip('# '))
            self.header = fields if is_header(fields) and len(fields) == len(rows[0][1]) else None
        if not rows:
            raise DataError(path, 'has no row of values')
        self.width = len(self.header or rows[0][1])
        for number, fields in rows:
            if len(fields) != self.width:
                raise DataError(path, f'line {number} has {len(fields)} fields, {self.width} are expected')
        self.rows = [Row(self, number, fields) for number, fields in rows]
        self._given = {meaning: self._position(meaning, column) for meaning, column in columns.items()}

    def _split(self, number: int, line: str) -> List[str]:
        if self._separator is None:
            return line.split()
        try:
            return [field.strip() for field in next(csv.reader([line], delimiter=self._separator, strict=True))]
        except csv.Error as error:
            raise DataError(self.path, f'line {number}: {error}') from error

    def name(self, column: int) -> str:
        """What to call a column."""
        return f"{column + 1} ('{self.header[column]}')" if self.header else str(column + 1)

    def _position(self, meaning: str, column: str) -> int:
        names = self.header or []
        if column in names:
            return names.index(column)
        if column.isascii() and column.isdigit() and 1 <= int(column[:9]) <= self.width:
            return int(column) - 1
        known = f'columns: {", ".join(names)}' if names else f'no header, columns 1 to {self.width}'
        raise DataError(self.path, f"there is no column '{column}' for {meaning} ({known})")

    def find(self, meaning: str) -> Optional[int]:
        """The column of a meaning; None without one."""
        if meaning in self._given:
            return self._given[meaning]
        found = [index for index, name in enumerate(self.header or []) if plain_name(name) in MEANINGS[meaning]]
        if len(found) > 1:
            raise DataError(self.path, f'columns {" and ".join(map(self.name, found))} may both be the {meaning}: say '
                            f'which by --column {meaning}=NAME')
        return found[0] if found else None


def plain_name(name: str) -> str:
    """A column's name without units and signs."""
    return re.sub('[^a-z0-9]', '', re.sub(r'[(\[].*?[)\]]', '', name.lower()))
