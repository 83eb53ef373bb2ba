"""What the names of experiments and methods mean."""
import re
from typing import List, NamedTuple, Optional, Tuple

from .data import Group, Number, Outcome, Results

KIDNAPPED = ', kidnapped'
CONSTANT: Group = ('constant', 'constant')
CHANGING: Group = ('changing', 'changing')
# Experiments of [H] on its two data sets, whose cost is compared by illumination.
HYBRID = ('hybrid', 'hybrid_set2')
GRID_NAME = re.compile(r'\brot (\S+) acc (\S+) v (\S+)')
SPEED_NAME = re.compile(r'^(.*) ([\d.]+)x$')
COUNT_NAME = re.compile(r'^(.*) (\d+)$')


class GridPoint(NamedTuple):
    """A setting of the linear motion model; the initial speed in multiples of the recorded speed."""
    rotation_deg: float
    acceleration: float
    speed: float


def group_title(group: Group) -> str:
    if group in (CONSTANT, CHANGING):
        return f'{group[0]} illumination'
    return f'{group[0]} → {group[1]}'


def floats(texts: Tuple[Optional[str], ...]) -> Optional[List[float]]:
    """Numbers, or None when one of the texts is not a number."""
    try:
        return [float(text) for text in texts]  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return None


def grid_point(method: str) -> Optional[GridPoint]:
    """The setting in a name such as 'PF-l-300 rot 20 acc 0.01 v 1'."""
    match = GRID_NAME.search(method)
    values = floats(match.groups()) if match else None
    return GridPoint(*values) if values else None


def speed_of(method: str) -> Optional[Tuple[str, float]]:
    """Variant and simulated speed in a name such as 'not adaptive 0.25x'."""
    match = SPEED_NAME.match(method)
    values = floats((match[2],)) if match else None
    return (match[1], values[0]) if match and values else None


def count_of(method: str) -> Optional[Tuple[str, int]]:
    """Variant and number of particles in a name such as 'hybrid 300'."""
    match = COUNT_NAME.match(method)
    return (match[1], int(match[2])) if match else None


def thresholds_of(results: Results, method: str) -> Optional[Tuple[float, float]]:
    """d_global and d_SIFT of a method, from what it sets or else from its name."""
    settings = results.settings.get(method, {})
    names = re.search(r'd_SIFT (\S+) d_global (\S+)', method)
    below = settings.get('hybrid/sift_below') or (names[1] if names else None)
    above = settings.get('hybrid/global_above') or (names[2] if names else None)
    values = floats((above, below))
    return (values[0], values[1]) if values else None


def is_kidnapped(results: Results, method: str) -> bool:
    flag = results.settings.get(method, {}).get('kidnapped', '').lower()
    return flag in ('true', '1') or method.endswith(KIDNAPPED)


def weighted(outcomes: List[Outcome], metric: str) -> Number:
    """A measure's mean over outcomes, weighted by their runs."""
    known = [(outcome.get(metric), outcome.get('runs') or 1) for outcome in outcomes]
    total = sum(runs for value, runs in known if value is not None)
    return sum(value * runs for value, runs in known if value is not None) / total if total else None


def by_illumination(results: Results) -> List[Outcome]:
    """Cost of each method where map and drive have the same light and where not; speed-up is relative to SIFT."""
    merged = []
    for group, same in ((CONSTANT, True), (CHANGING, False)):
        chosen = [outcome for outcome in results.outcomes if (outcome.group[0] == outcome.group[1]) == same]
        rows = [Outcome(group, method, {metric: weighted([one for one in chosen if one.method == method], metric)
                                        for metric in ('sift_share', 'ms_per_image')})
                for method in dict.fromkeys(outcome.method for outcome in chosen)]
        sift = next((row.get('ms_per_image') for row in rows if row.method == 'SIFT'), None)
        for row in rows:
            own = row.get('ms_per_image')
            row.values['speed_up'] = sift / own if sift and own and row.method != 'SIFT' else None
        merged += rows
    return merged
