"""The papers' numbers, as config/evaluation/papers.csv holds them."""
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Optional, Tuple

from .data import DataError, Group, Number, number, read_rows

COLUMNS = ('experiment', 'source', 'train_group', 'test_group', 'method', 'metric', 'value')
# Numbers that hold for every illumination.
ANY: Group = ('any', 'any')


@dataclass(frozen=True)
class PaperValue:
    """A number as printed, and its source."""
    text: str
    value: float
    source: str

    def decimals(self) -> int:
        return len(self.text.partition('.')[2])

    def rounds(self, other: 'PaperValue') -> bool:
        return abs(other.value - self.value) <= 0.5 * 10.0 ** -self.decimals() + 1e-9


def method_key(method: str) -> str:
    """A name independent of case and of the spelling of numbers: 1e-05 is 0.00001."""
    words = method.lower().replace('wgii + wgoh', 'global').split()
    return ' '.join(_spelled(word) for word in words)


def _spelled(word: str) -> str:
    try:
        return repr(float(word))
    except ValueError:
        return word


def group_key(group: Group) -> Group:
    """Groups by the papers' names: sunny_1 belongs to sunny."""
    return tuple(re.sub(r'[\W_]*\d*$', '', name.lower()) for name in group)  # type: ignore[return-value]


class Papers:
    """The papers' numbers; for each, the leading source first."""

    def __init__(self, path: Optional[Path]):
        self._values: Dict[Tuple[str, Group, str, str], List[PaperValue]] = {}
        self._sources: Dict[str, List[str]] = {}
        if path is None:
            return
        for line, row in read_rows(path, COLUMNS):
            value = number(path, line, 'value', row['value'])
            if value is None:
                raise DataError(path, f'line {line}: value is empty')
            key = (row['experiment'], group_key((row['train_group'], row['test_group'])), method_key(row['method']),
                   row['metric'])
            self._values.setdefault(key, []).append(PaperValue(row['value'], value, row['source']))
            sources = self._sources.setdefault(row['experiment'], [])
            if row['source'] not in sources:
                sources.append(row['source'])

    def sources(self, experiment: str) -> List[str]:
        """Sources of the experiment's numbers, the leading one first."""
        return self._sources.get(experiment, [])

    def all(self, experiment: str, group: Group, method: str, metric: str) -> List[PaperValue]:
        for key in (group_key(group), ANY):
            found = self._values.get((experiment, key, method_key(method), metric))
            if found:
                return found
        return []

    def lead(self, experiment: str, group: Group, method: str, metric: str) -> Number:
        """The leading source's number; None when the papers have none."""
        found = self.all(experiment, group, method, metric)
        return found[0].value if found else None

    def differing(self, experiment: str, group: Group, method: str, metric: str) -> List[PaperValue]:
        """The leading number, and those of other sources that differ by more than rounding."""
        found = self.all(experiment, group, method, metric)
        return found[:1] + [other for other in found[1:] if not found[0].rounds(other)]
