"""Reads the result folder of `evaluate`: experiment.yaml and the CSV files. An empty field is None."""
import csv
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple

import yaml

Group = Tuple[str, str]
Number = Optional[float]

KEYS = ('train_group', 'test_group', 'method')
# A summary must have these measures; all others may be missing.
NEEDED_MEASURES = ('mean_err_m',)
CURVES = ('mean_err_m', 'comparisons', 'sift_share')
TRACES = ('err_m', 'v0', 'speed_ema', 'quantum_share', 'phi2', 'recovering', 'spread_x_m', 'spread_y_m', 'diversity_m',
          'similarity', 'comparisons', 'swarm_mps', 'robot_mps')


# What HTML and Markdown would take for more than text, and what stands for it in a report.
MARKS = str.maketrans({'<': '\u2039', '>': '\u203a', '`': "'"})


def printable(text: str) -> str:
    """Foreign text without what a terminal obeys or what turns the order of the text around."""
    return ''.join(letter if letter.isprintable() else '?' for letter in text)


def plain(text: str) -> str:
    """Foreign text that a report shows and that nobody runs."""
    return printable(' '.join(text.split())).translate(MARKS)


class DataError(Exception):
    """Says what is wrong with a file."""

    def __init__(self, path: Path, what: str):
        super().__init__(printable(f'{path}: {" ".join(what.split())}'))


@dataclass
class Outcome:
    """The measures of one method over all runs of a pair of groups."""
    group: Group
    method: str
    values: Dict[str, Number]

    def get(self, metric: str) -> Number:
        """The measure in the papers' units; None when it is not defined."""
        if metric == 's_per_image':
            milliseconds = self.values.get('ms_per_image')
            return None if milliseconds is None else milliseconds / 1000
        return self.values.get(metric)


@dataclass
class Series:
    """Columns over the images of a run; `step` counts the images since the start."""
    step: List[float] = field(default_factory=list)
    columns: Dict[str, List[float]] = field(default_factory=dict)

    def add(self, step: float, row: Dict[str, Number]) -> None:
        """Appends one image; an undefined value becomes NaN, which a plot omits."""
        self.step.append(step)
        for name, value in row.items():
            self.columns.setdefault(name, []).append(math.nan if value is None else value)

    def has(self, name: str) -> bool:
        return any(math.isfinite(value) for value in self.columns.get(name, []))


class Claim(NamedTuple):
    """Images of a method whose probability lies in a bin."""
    method: str
    begin: float
    images: float
    probability: float  # mean
    not_wrong: float  # share


@dataclass
class Results:
    """The content of the folder."""
    experiment: str
    description: Dict[str, Any]
    outcomes: List[Outcome]
    pairs: List[Tuple[str, str]]
    settings: Dict[str, Dict[str, str]]
    steps: Dict[Group, Dict[str, Series]]
    traces: Dict[Tuple[str, str], Dict[str, Series]]
    claims: List[Claim] = field(default_factory=list)

    def groups(self) -> List[Group]:
        return list(dict.fromkeys(outcome.group for outcome in self.outcomes))

    def of(self, group: Group) -> List[Outcome]:
        return [outcome for outcome in self.outcomes if outcome.group == group]

    def methods(self) -> List[str]:
        """Every method once, in the order of the experiment, including those with curves only."""
        names = [outcome.method for outcome in self.outcomes]
        for curves in (*self.steps.values(), *self.traces.values()):
            names += curves
        return list(dict.fromkeys(names))


def read_rows(path: Path, needed: Tuple[str, ...]) -> Iterator[Tuple[int, Dict[str, str]]]:
    """Line number and named fields of every row."""
    try:
        with open(path, newline='', encoding='utf-8-sig') as file:
            reader = csv.reader(file, strict=True)
            header = next(reader, None)
            if header is None:
                raise DataError(path, 'is empty, a header was expected')
            missing = [name for name in needed if name not in header]
            if missing:
                raise DataError(path, f'has no column {missing[0]}')
            for fields in reader:
                if not fields:
                    continue
                if len(fields) != len(header):
                    raise DataError(path, f'line {reader.line_num}: has {len(fields)} fields, the header {len(header)}')
                yield reader.line_num, dict(zip(header, map(plain, fields)))
    except OSError as error:
        raise DataError(path, error.strerror or str(error)) from error
    except (csv.Error, UnicodeDecodeError) as error:
        raise DataError(path, f'is not a CSV file in UTF-8: {error}') from error


def number(path: Path, line: int, name: str, text: str) -> Number:
    """A field as a number; None when empty or not finite."""
    if not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        raise DataError(path, f'line {line}: {name} is "{text}", not a number') from None
    return value if math.isfinite(value) else None


def truth(path: Path, line: int, name: str, text: str) -> Number:
    """A flag as 0 or 1, written as a number or as a word."""
    words = {'true': 1.0, 'false': 0.0}
    return words[text.lower()] if text.lower() in words else number(path, line, name, text)


def read_outcomes(path: Path) -> Tuple[str, List[Outcome]]:
    experiment, outcomes = '', []
    for line, row in read_rows(path, (*KEYS, *NEEDED_MEASURES)):
        experiment = experiment or row.get('experiment', '')
        values = {name: number(path, line, name, text) for name, text in row.items()
                  if name not in KEYS and name != 'experiment'}
        outcomes.append(Outcome((row['train_group'], row['test_group']), row['method'], values))
    if not outcomes:
        raise DataError(path, 'has no rows')
    return experiment, outcomes


def read_series(path: Path, keys: Tuple[str, str], names: Tuple[str, ...]) -> Dict[Group, Dict[str, Series]]:
    """Curves by the two key columns and by method; empty when the file is missing."""
    result: Dict[Group, Dict[str, Series]] = {}
    if not path.exists():
        return result
    for line, row in read_rows(path, (*keys, 'method', 'step')):
        step = number(path, line, 'step', row['step'])
        if step is None:
            raise DataError(path, f'line {line}: step is empty')
        values = {name: (truth if name == 'recovering' else number)(path, line, name, row[name])
                  for name in names if name in row}
        series = result.setdefault((row[keys[0]], row[keys[1]]), {}).setdefault(row['method'], Series())
        series.add(step, values)
    return result


def read_pairs(path: Path) -> List[Tuple[str, str]]:
    if not path.exists():
        return []
    rows = read_rows(path, ('train_round', 'test_round'))
    return list(dict.fromkeys((row['train_round'], row['test_round']) for _, row in rows))


def read_settings(path: Path) -> Dict[str, Dict[str, str]]:
    """The settings of every method, by method and key; empty when the file is missing."""
    settings: Dict[str, Dict[str, str]] = {}
    if path.exists():
        for _, row in read_rows(path, ('method', 'key', 'value')):
            settings.setdefault(row['method'], {})[row['key']] = row['value']
    return settings


def read_claims(path: Path) -> List[Claim]:
    """The rows of reliability.csv, of all pairs of groups; empty when the file is missing."""
    columns = ('from', 'images', 'mean_probability', 'not_wrong_share')
    claims: List[Claim] = []
    if path.exists():
        for line, row in read_rows(path, ('method', *columns)):
            values = [number(path, line, name, row[name]) for name in columns]
            if None in values:
                raise DataError(path, f'line {line}: {columns[values.index(None)]} is empty')
            claims.append(Claim(row['method'], *values))
    return claims


def read_description(path: Path) -> Dict[str, Any]:
    """The experiment's YAML; empty when the file is missing."""
    if not path.exists():
        return {}
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise DataError(path, error.strerror or str(error)) from error
    except (yaml.YAMLError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise DataError(path, f'is not YAML: {error}') from error
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise DataError(path, 'is not a YAML mapping')
    return content


def read_results(folder: Path) -> Results:
    """The content of the folder; only summary.csv is required."""
    if not folder.is_dir():
        raise DataError(folder, 'is not a folder')
    description = read_description(folder / 'experiment.yaml')
    name, outcomes = read_outcomes(folder / 'summary.csv')
    return Results(
        experiment=plain(str(description.get('experiment') or name or folder.resolve().name)),
        description=description,
        outcomes=outcomes,
        pairs=read_pairs(folder / 'pairs.csv'),
        settings=read_settings(folder / 'methods.csv'),
        steps=read_series(folder / 'steps.csv', ('train_group', 'test_group'), CURVES),
        traces=read_series(folder / 'traces.csv', ('train_round', 'test_round'), TRACES),
        claims=read_claims(folder / 'reliability.csv'))
