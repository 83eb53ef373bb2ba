"""The comparison with the papers, in sentences: order and ratios, and whether they agree."""
from itertools import combinations
from typing import Dict, List, NamedTuple, Tuple

from .data import Group, Outcome, Results
from .experiments import by_illumination, count_of, group_title, marginals, ratio_pairs
from .papers import Papers

# Ratios this close count as the same: neither the images nor the robot are the papers'.
TOLERANCE = 0.25
# So many turned pairs are told one by one; the table shows the others.
TOLD = 6
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
    """Collects sentences and counts how many of them agree."""

    def __init__(self) -> None:
        self.lines: List[str] = []
        self._ratios = [0, 0]
        self._order = [0, 0]

    def heading(self, text: str) -> None:
        """Starts a section."""
        self.lines.append(f'\n### {text}\n')

    def include(self, title: str, section: 'Words') -> None:
        """Takes a section over, unless it is empty."""
        if section.lines:
            self.heading(title)
            self.lines += section.lines
            for own, other in ((self._ratios, section._ratios), (self._order, section._order)):
                own[:] = [a + b for a, b in zip(own, other)]

    def order(self, what: str, both: Both) -> None:
        """Whether the methods come in the same order, and which pairs are turned."""
        if len(both.ours) < 2:
            return
        turned = list(turned_pairs(both))
        total = sum(1 for _ in judged_pairs(both))
        self._order[0] += total - len(turned)
        self._order[1] += total
        line = f'- Order by {what}, lowest first. Here: {ranking(both.ours)}. Papers: {ranking(both.papers)}. '
        if not turned:
            self.lines.append(line + f'All {total} pairs are in the papers\' order.')
            return
        told = '; '.join(f'`{first}` before `{second}` in the papers ({both.papers[first]:.3g} and '
                         f'{both.papers[second]:.3g}), here behind it ({both.ours[first]:.3g} and '
                         f'{both.ours[second]:.3g})' for first, second in turned[:TOLD])
        more = f'; and {len(turned) - TOLD} more' if len(turned) > TOLD else ''
        self.lines.append(line + f'{total - len(turned)} of {total} pairs are in the papers\' order. '
                          f'Turned: {told}{more}.')

    def ratio(self, what: str, first: str, second: str, both: Both) -> None:
        """One method's measure over another's, here and in the papers."""
        if not both.ours[second] or not both.papers[second]:
            return
        here, there = both.ours[first] / both.ours[second], both.papers[first] / both.papers[second]
        self.agreement(f'{what} of `{first}` over `{second}`', here, there)

    def agreement(self, what: str, here: float, there: float, scale: float = 1, unit: str = '') -> None:
        """Two numbers that should be the same, and by how much they are not."""
        if not there:
            return
        line = (f'- {what[0].upper() + what[1:]}: {scale * here:.2f}{unit} here, {scale * there:.2f}{unit} in the '
                'papers: ')
        off = here / there - 1
        agrees = abs(off) <= TOLERANCE
        self._ratios[0] += agrees
        self._ratios[1] += 1
        self.lines.append(line + f'{"agrees" if agrees else "**differs**"} ({100 * off:+.0f} %).')

    def text(self) -> str:
        """Everything, with the tally in front."""
        if not self.lines:
            return 'The papers have no numbers that this experiment could be held against.\n'
        tally = []
        if self._ratios[1]:
            tally.append(f'{self._ratios[0]} of {self._ratios[1]} ratios agree with the papers within '
                         f'{100 * TOLERANCE:.0f} %')
        if self._order[1]:
            tally.append(f'{self._order[0]} of {self._order[1]} pairs of methods are in the papers\' order')
        return '; '.join(tally) + '.\n' + '\n'.join(self.lines) + '\n'


def ranking(values: Dict[str, float]) -> str:
    """The methods, lowest value first."""
    return ' < '.join(f'`{name}`' for name in sorted(values, key=lambda name: values[name]))


def judged_pairs(both: Both) -> List[Tuple[str, str]]:
    """Pairs that the papers put in an order, the lower one first."""
    return [(first, second) if both.papers[first] < both.papers[second] else (second, first)
            for first, second in combinations(both.ours, 2) if both.papers[first] != both.papers[second]]


def turned_pairs(both: Both) -> List[Tuple[str, str]]:
    """Pairs whose order is another one here; those furthest apart in the papers first."""
    turned = [(first, second) for first, second in judged_pairs(both) if both.ours[first] >= both.ours[second]]
    return sorted(turned, key=lambda pair: both.papers[pair[0]] - both.papers[pair[1]])


def common(experiment: str, outcomes: List[Outcome], metric: str, papers: Papers) -> Both:
    """The measure of those methods that both have."""
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


def compare_cost(words: Words, results: Results, papers: Papers) -> None:
    """What the hybrid saves, by illumination ([H] Table II)."""
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
    """The motion grid: its best cell, and the mean over each of its axes."""
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
    """How much error fewer particles cost: the papers give differences to 300 particles only ([H] Section V)."""
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
            words.lines.append(f'- `{method}`: {above:+.2f} m mean error against 300 particles here, {there:+.2f} m in '
                               'the paper, averaged over the pairs of groups.')


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
    if results.experiment == 'hybrid':
        compare_cost(words, results, papers)
    return words.text()
