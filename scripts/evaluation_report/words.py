"""The comparison with the papers in sentences: order, ratios, and whether they agree."""
import math
from itertools import combinations
from statistics import NormalDist
from typing import Dict, List, NamedTuple, Optional, Tuple

from .data import Group, Outcome, Results
from .experiments import HYBRID, by_illumination, count_of, group_title, marginals, ratio_pairs, tested_pairs
from .papers import Papers

# Ratios this close count as equal: images and robot are not the papers'.
TOLERANCE = 0.25
# Ratios this close to 1 have no winner.
TIE = 0.02
# Of the papers' t-tests, one-sided ([J] section 7.2).
SIGNIFICANCE = 0.005
# With fewer runs a t-test needs another distribution than the normal one.
FEWEST_RUNS = 100
# At most this many reversed pairs are listed; the table shows all.
LISTED = 6
RATIO_METRICS = {'mean_err_m': 'mean error', 'comparisons_per_image': 'comparisons per image'}
# The ratio of these to SIFT alone is the speed-up already.
ORDER_METRICS = {'s_per_image': 'time per image'}
# Measures that are ratios themselves.
DIRECT_METRICS = {'sift_share': ('share of SIFT steps', 100, ' %'), 'speed_up': ('speed-up over SIFT', 1, '')}


class Both(NamedTuple):
    """A measure by method, for the methods that both have."""
    ours: Dict[str, float]
    papers: Dict[str, float]


class Words:
    """Collects sentences and counts those that agree."""

    def __init__(self) -> None:
        self.lines: List[str] = []
        self._ratios = [0, 0]
        self._order = [0, 0]
        self._tests = [0, 0]

    def heading(self, text: str) -> None:
        """Starts a section."""
        self.lines.append(f'\n### {text}\n')

    def include(self, title: str, section: 'Words') -> None:
        """Appends another section, unless it is empty."""
        if section.lines:
            self.heading(title)
            self.lines += section.lines
            for own, other in ((self._ratios, section._ratios), (self._order, section._order),
                               (self._tests, section._tests)):
                own[:] = [a + b for a, b in zip(own, other)]

    def order(self, what: str, both: Both) -> None:
        """Whether the methods have the same order, and which pairs are reversed."""
        if len(both.ours) < 2:
            return
        reversed_ = reversed_pairs(both)
        total = sum(1 for _ in judged_pairs(both))
        self._order[0] += total - len(reversed_)
        self._order[1] += total
        line = f'- Order by {what}, lowest first. Here: {ranking(both.ours)}. Papers: {ranking(both.papers)}. '
        if not reversed_:
            self.lines.append(line + f'All {total} pairs are in the papers\' order.')
            return
        listed = '; '.join(f'`{first}` and `{second}` (papers {both.papers[first]:.3g} < {both.papers[second]:.3g}, '
                           f'here {both.ours[first]:.3g} ≥ {both.ours[second]:.3g})'
                           for first, second in reversed_[:LISTED])
        more = f'; and {len(reversed_) - LISTED} more' if len(reversed_) > LISTED else ''
        self.lines.append(line + f'{total - len(reversed_)} of {total} pairs are in the papers\' order. '
                          f'Reversed: {listed}{more}.')

    def ratio(self, what: str, first: str, second: str, both: Both) -> None:
        """The ratio of one method's measure to another's, here and in the papers."""
        if not both.ours[second] or not both.papers[second]:
            return
        here, there = both.ours[first] / both.ours[second], both.papers[first] / both.papers[second]
        self.agreement(f'{what}, `{first}` / `{second}`', here, there, is_reversed=have_other_winners(here, there))

    def agreement(self, what: str, here: float, there: float, scale: float = 1, unit: str = '', *,
                  is_reversed: bool = False) -> None:
        """Two numbers that should be equal, and their relative difference. Those with another winner do not agree."""
        if not there:
            return
        line = (f'- {what[0].upper() + what[1:]}: {scale * here:.2f}{unit} here, {scale * there:.2f}{unit} in the '
                'papers: ')
        off = here / there - 1
        agrees = abs(off) <= TOLERANCE and not is_reversed
        self._ratios[0] += agrees
        self._ratios[1] += 1
        verdict = '**reversed**' if is_reversed else 'agrees' if agrees else '**differs**'
        self.lines.append(f'{line}{verdict} ({100 * off:+.0f} %).')

    def t_test(self, better: Outcome, worse: Outcome) -> None:
        """Whether a method has the lower error by a t-test, as in the papers."""
        t = welch_t(better, worse)
        if t is None:
            return
        agrees = NormalDist().cdf(t) < SIGNIFICANCE
        self._tests[0] += agrees
        self._tests[1] += 1
        verdict = 'agrees' if agrees else '**not reproduced**'
        self.lines.append(f'- Error of `{better.method}` below that of `{worse.method}` by a t-test: t = {t:.1f}; '
                          f'papers: below, on a level of {100 * SIGNIFICANCE:g} %: {verdict}.')

    def text(self) -> str:
        """All sentences, the tally first."""
        if not self.lines:
            return 'The papers give no numbers for this experiment.\n'
        tally = []
        if self._ratios[1]:
            tally.append(f'{self._ratios[0]} of {self._ratios[1]} ratios agree with the papers within '
                         f'{100 * TOLERANCE:.0f} % and have the same winner')
        if self._order[1]:
            tally.append(f'{self._order[0]} of {self._order[1]} pairs of methods are in the papers\' order')
        if self._tests[1]:
            tally.append(f'{self._tests[0]} of {self._tests[1]} t-tests have the papers\' result (their runs share '
                         'images: in both, here and in the papers, differences are less certain than the tests say)')
        return ('; '.join(tally) + '.\n' if tally else '') + '\n'.join(self.lines) + '\n'


def have_other_winners(here: float, there: float) -> bool:
    """Whether two ratios lie on different sides of 1."""
    return (here - 1) * (there - 1) < 0 and min(abs(here - 1), abs(there - 1)) > TIE


def welch_t(first: Outcome, second: Outcome) -> Optional[float]:
    """Welch's t of the mean errors of two methods; None when it is not known or the runs are few."""
    values = [outcome.get(name) for outcome in (first, second) for name in ('mean_err_m', 'std_err_m', 'runs')]
    if any(value is None for value in values):
        return None
    mean_a, std_a, runs_a, mean_b, std_b, runs_b = values  # type: ignore[misc]
    if min(runs_a, runs_b) < FEWEST_RUNS or std_a + std_b == 0:
        return None
    return (mean_a - mean_b) / math.sqrt(std_a ** 2 / runs_a + std_b ** 2 / runs_b)


def ranking(values: Dict[str, float]) -> str:
    """The methods, lowest value first."""
    return ' < '.join(f'`{name}`' for name in sorted(values, key=lambda name: values[name]))


def judged_pairs(both: Both) -> List[Tuple[str, str]]:
    """Pairs whose values differ in the papers, the lower one first."""
    return [(first, second) if both.papers[first] < both.papers[second] else (second, first)
            for first, second in combinations(both.ours, 2) if both.papers[first] != both.papers[second]]


def reversed_pairs(both: Both) -> List[Tuple[str, str]]:
    """Pairs in another order here; those furthest apart in the papers first."""
    found = [(first, second) for first, second in judged_pairs(both) if both.ours[first] >= both.ours[second]]
    return sorted(found, key=lambda pair: both.papers[pair[0]] - both.papers[pair[1]])


def common(experiment: str, outcomes: List[Outcome], metric: str, papers: Papers) -> Both:
    """The measure of the methods that both have."""
    both = Both({}, {})
    for outcome in outcomes:
        here, there = outcome.get(metric), papers.lead(experiment, outcome.group, outcome.method, metric)
        if here is not None and there is not None:
            both.ours[outcome.method], both.papers[outcome.method] = here, there
    return both


def compare(words: Words, experiment: str, group: Group, outcomes: List[Outcome], papers: Papers) -> None:
    """Order and ratios of the methods in a pair of groups."""
    found = {metric: common(experiment, outcomes, metric, papers) for metric in RATIO_METRICS}
    if all(len(both.ours) < 2 for both in found.values()):
        return
    words.heading(group_title(group))
    for metric, what in RATIO_METRICS.items():
        words.order(what, found[metric])
        for first, second in ratio_pairs(experiment, list(found[metric].ours)):
            words.ratio(what, first, second, found[metric])
    by_method = {outcome.method: outcome for outcome in outcomes}
    for better, worse in tested_pairs(experiment, list(by_method)):
        words.t_test(by_method[better], by_method[worse])


def compare_cost(words: Words, results: Results, papers: Papers) -> None:
    """Cost of the hybrid by illumination ([H] Table II)."""
    merged = by_illumination(results)
    for group in dict.fromkeys(outcome.group for outcome in merged):
        outcomes = [outcome for outcome in merged if outcome.group == group]
        section = Words()
        for metric, what in ORDER_METRICS.items():
            section.order(what, common(results.experiment, outcomes, metric, papers))
        for metric, (what, scale, unit) in DIRECT_METRICS.items():
            both = common(results.experiment, outcomes, metric, papers)
            for method, value in both.ours.items():
                section.agreement(f'{what} of `{method}`', value, both.papers[method], scale, unit)
        words.include(group_title(group), section)


def compare_grid(words: Words, results: Results, papers: Papers) -> None:
    """The motion grid: its best cell, and the means along each axis."""
    for group in results.groups():
        both = common(results.experiment, results.of(group), 'mean_err_m', papers)
        if len(both.ours) < 2:
            continue
        words.heading(group_title(group))
        best = min(both.ours, key=lambda name: both.ours[name])
        theirs = min(both.papers, key=lambda name: both.papers[name])
        words.lines.append(f'- Best setting here: `{best}` ({both.ours[best]:.2f} m; papers '
                           f'{both.papers[best]:.2f} m). '
                           f'In the papers: `{theirs}` ({both.papers[theirs]:.2f} m; here {both.ours[theirs]:.2f} m).')
        here, there = marginals(both.ours), marginals(both.papers)
        for axis in here:
            means = Both(here[axis], there[axis])
            what = f'mean error over the {axis}'
            words.order(what, means)
            worst = max(means.papers, key=lambda name: means.papers[name], default='')
            for name in means.ours:
                if name != worst:
                    words.ratio(what, name, worst, means)


def compare_counts(words: Words, results: Results, papers: Papers) -> None:
    """Error by number of particles: the paper gives only differences to 300 ([H] Section V)."""
    means: Dict[str, List[float]] = {}
    for outcome in results.outcomes:
        error = outcome.get('mean_err_m')
        if error is not None:
            means.setdefault(outcome.method, []).append(error)
    for method, errors in means.items():
        count = count_of(method)
        there = papers.lead(results.experiment, results.groups()[0], method, 'err_above_300_m')
        base = means.get(f'{count[0]} 300') if count else None
        if there is not None and base:
            above = sum(errors) / len(errors) - sum(base) / len(base)
            words.lines.append(f'- `{method}`: mean error {above:+.2f} m relative to 300 particles here, {there:+.2f} '
                               'm in the paper; mean over the pairs of groups.')


def in_words(results: Results, papers: Papers) -> str:
    """The whole section."""
    words = Words()
    if results.experiment == 'motion_grid':
        compare_grid(words, results, papers)
        return words.text()
    if results.experiment == 'hybrid_particles':
        compare_counts(words, results, papers)
    for group in results.groups():
        compare(words, results.experiment, group, results.of(group), papers)
    if results.experiment in HYBRID:
        compare_cost(words, results, papers)
    return words.text()
