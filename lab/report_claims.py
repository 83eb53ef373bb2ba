#!/usr/bin/python3
"""Tests the papers' claims on the results of both presets: one table, claim by claim.

Reads config/evaluation/papers/claims.yaml, which says when a claim agrees, and for each experiment the pairs.csv and
summary.csv that `evaluate` wrote into ROOT/paper/NAME and ROOT/paper_program/NAME. Writes ROOT/claims.md.
"""
import argparse
import csv
import math
import sys
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

import yaml

import package_scripts
from evaluation_report.data import DataError, Group, number, read_rows
from evaluation_report.files import written_whole
from evaluation_report.papers import Papers, group_key, method_key
from evaluation_report.tables import markdown

PRESETS = ('paper', 'paper_program')
MARGIN = 0.2  # of a ratio or a value: claims.yaml
# Student's t, two-sided 95 %, by degrees of freedom; beyond, that of the normal distribution plus its first correction.
T95 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)

AGREES, CONTRADICTS, OPEN, UNKNOWN = 'agrees', '**contradicts**', 'open', '–'


def t95(freedom: int) -> float:
    return T95[freedom - 1] if freedom <= len(T95) else 1.96 + 2.4 / freedom


class Pair(NamedTuple):
    """A map and a drive."""
    map: str
    drive: str


class Results:
    """A metric by group, method and pair of rounds, of one experiment under one preset."""

    def __init__(self, folder: Path, metric: str):
        self._values: Dict[Tuple[Group, str], Dict[Pair, float]] = {}
        source = folder / ('traces.csv' if metric == 'diversity_m' else 'pairs.csv')
        sums: Dict[Tuple[Group, str, Pair], List[float]] = {}
        for line, row in read_rows(source, ('train_round', 'test_round', 'method', metric)):
            value = number(source, line, metric, row[metric])
            if value is None:
                continue
            group = group_key((row.get('train_group', row['train_round']), row.get('test_group', row['test_round'])))
            sums.setdefault((group, method_key(row['method']), Pair(row['train_round'], row['test_round'])),
                            []).append(value)
        for (group, method, pair), values in sums.items():
            self._values.setdefault((group, method), {})[pair] = sum(values) / len(values)

    def groups(self, method: str) -> List[Group]:
        return [group for group, name in self._values if name == method_key(method)]

    def of(self, group: Group, method: str) -> Dict[Pair, float]:
        found = self._values.get((group_key(group), method_key(method)))
        if not found:
            raise DataError(Path(), f'no result of {method!r} for {group[0]} to {group[1]}')
        return found


class Interval(NamedTuple):
    """A mean with its 95 % interval over pairs of rounds; `half` is infinite with one pair."""
    mean: float
    half: float
    smaller: int  # pairs with a negative value
    count: int


def interval(values: List[float]) -> Interval:
    count = len(values)
    mean = sum(values) / count
    if count < 2:
        return Interval(mean, math.inf, sum(value < 0 for value in values), count)
    deviation = math.sqrt(sum((value - mean) ** 2 for value in values) / (count - 1))
    return Interval(mean, t95(count - 1) * deviation / math.sqrt(count), sum(value < 0 for value in values), count)


class Verdict(NamedTuple):
    """What a claim comes to under one preset."""
    figures: str
    verdict: str


def together(verdicts: List[str]) -> str:
    for worst in (UNKNOWN, CONTRADICTS, OPEN):
        if worst in verdicts:
            return worst
    return AGREES


def plus_minus(found: Interval, decimals: int) -> str:
    half = '' if math.isinf(found.half) else f' ± {found.half:.{decimals}f}'
    return f'{found.mean:.{decimals}f}{half}'


def test_order(results: Results, group: Group, methods: List[str]) -> Verdict:
    a, b = (results.of(group, method) for method in methods)
    found = interval([a[pair] - b[pair] for pair in a])
    verdict = OPEN
    if not math.isinf(found.half) and abs(found.mean) > found.half:
        verdict = AGREES if found.mean < 0 else CONTRADICTS
    return Verdict(f'{plus_minus(found, 2)} ({found.smaller} of {found.count} pairs)', verdict)


def test_size(results: Results, group: Group, methods: List[str], wanted: Optional[float]) -> Verdict:
    a = results.of(group, methods[0])
    b = results.of(group, methods[1]) if len(methods) == 2 else {pair: 1.0 for pair in a}
    found = interval([a[pair] / b[pair] for pair in a])
    decimals = 2 if len(methods) == 2 else 1
    if wanted is None:
        return Verdict(plus_minus(found, decimals), UNKNOWN)
    agrees = abs(found.mean / wanted - 1.0) <= MARGIN
    return Verdict(plus_minus(found, decimals), AGREES if agrees else CONTRADICTS)


class Claim:
    """One entry of claims.yaml."""

    def __init__(self, entry: Dict, papers: Papers):
        self.text: str = entry['claim']
        self.experiment: str = entry['experiment']
        self.metric: str = entry['metric']
        self.kind = next(kind for kind in ('less', 'ratio', 'value') if kind in entry)
        named = entry[self.kind]
        self.methods: List[str] = named if isinstance(named, list) else [named]
        self._only = [group_key(tuple(group)) for group in entry.get('groups', [])]
        self._papers = papers
        self._source = entry.get('papers', self.experiment)

    def paper(self, group: Group) -> Optional[float]:
        """The papers' difference, ratio or value; None when they have none for the group."""
        values = [self._papers.lead(self._source, group, method, self.metric) for method in self.methods]
        if any(value is None for value in values):
            return None
        if self.kind == 'less':
            return values[0] - values[1]
        return values[0] / values[1] if self.kind == 'ratio' else values[0]

    def groups(self, results: Results) -> List[Group]:
        groups = [group for group in results.groups(self.methods[0]) if not self._only or group in self._only]
        known = [group for group in groups if self.paper(group) is not None]
        return known or groups

    def papers_figures(self, results: Results) -> str:
        figures = [self.paper(group) for group in self.groups(results)]
        return ', '.join('–' if figure is None else f'{figure:.2f}' for figure in figures)

    def test(self, results: Results) -> Verdict:
        found = [test_order(results, group, self.methods) if self.kind == 'less' else
                 test_size(results, group, self.methods, self.paper(group)) for group in self.groups(results)]
        return Verdict(', '.join(one.figures for one in found), together([one.verdict for one in found]))


def read_runs(path: Path) -> Dict[Tuple[Group, str], Tuple[float, float, float]]:
    """Mean error, its standard deviation over the runs, and their number."""
    runs = {}
    for line, row in read_rows(path, ('train_group', 'test_group', 'method', 'runs', 'mean_err_m', 'std_err_m')):
        figures = tuple(number(path, line, name, row[name]) for name in ('mean_err_m', 'std_err_m', 'runs'))
        if None not in figures:
            runs[(group_key((row['train_group'], row['test_group'])), method_key(row['method']))] = figures
    return runs


def student_table(root: Path, experiment: str, pairs: Tuple[Tuple[str, str], ...]) -> str:
    """The test that [J] makes: two samples of runs, which are not independent of each other."""
    rows = []
    for preset in PRESETS:
        runs = read_runs(root / preset / experiment / 'summary.csv')
        for group in dict.fromkeys(group for group, _ in runs):
            for a, b in pairs:
                first, second = runs.get((group, method_key(a))), runs.get((group, method_key(b)))
                if not first or not second:
                    continue
                error = math.sqrt(first[1] ** 2 / first[2] + second[1] ** 2 / second[2])
                rows.append([f'{preset}: {" → ".join(group)}', f'{a} − {b}', f'{first[0] - second[0]:.2f}',
                             f'{(first[0] - second[0]) / error:.1f}' if error > 0 else '–'])
    return markdown(['preset: rounds', 'methods', 'difference [m]', 't'], rows)


def report(root: Path, entries: List[Dict], why: Dict[str, str], papers: Papers) -> str:
    rows, counts = [], {preset: {} for preset in PRESETS}
    for entry in entries:
        claim = Claim(entry, papers)
        cells, figures = [], ''
        for preset in PRESETS:
            folder = root / preset / claim.experiment
            if not (folder / 'pairs.csv').is_file() and not (folder / 'traces.csv').is_file():
                cells += ['–', UNKNOWN]
                continue
            results = Results(folder, claim.metric)
            found = claim.test(results)
            figures = claim.papers_figures(results)
            cells += [found.figures, found.verdict]
            counts[preset][found.verdict] = counts[preset].get(found.verdict, 0) + 1
        rows.append([claim.text, figures, *cells, why.get(claim.text, '')])
    totals = '; '.join(f'{preset}: ' + ', '.join(f'{count} {verdict.strip("*")}'
                                                for verdict, count in sorted(counts[preset].items()))
                       for preset in PRESETS)
    header = ['claim', 'papers', "papers' text", '', "authors' program", '', 'why']
    return ("# The papers' claims\n\n"
            'Made by `lab/report_claims.py`; `config/evaluation/papers/claims.yaml` says when a claim agrees. Differences, '
            'ratios and values with their 95 % intervals over pairs of rounds; several groups in the order sunny → '
            'sunny, cloudy → cloudy, sunny → cloudy, cloudy → sunny, as far as the papers have them.\n\n'
            f'{totals}.\n\n' + markdown(header, rows)
            + "\n## Student's t-test over runs\n\nAs in [J], section 7.4. Runs of the same pair of rounds are not "
              'independent, so it is far too sure; the intervals above are over pairs.\n\n'
            + student_table(root, 'comparison', (('DPSO-80', 'PF-l-100'), ('DPSO-80', 'PF-g-300'),
                                                 ('PF-l-300', 'DPSO-80'), ('PF-l-300', 'PF-l-100'))))


def main() -> int:
    """Exit code 0, or 1 with one line when a file is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('root', type=Path, metavar='ROOT', help='folder of the reports')
    parser.add_argument('--config', type=Path, default=package_scripts.FOLDER.parent / 'config/evaluation', metavar='DIR',
                        help='where papers/claims.yaml and papers.csv are (default: %(default)s)')
    arguments = parser.parse_args()
    try:
        content = yaml.safe_load((arguments.config / 'papers/claims.yaml').read_text(encoding='utf-8'))
        text = report(arguments.root, content['claims'], content.get('why') or {},
                      Papers(arguments.config / 'papers.csv'))
        with written_whole(arguments.root / 'claims.md') as partial:
            partial.write_text(text, encoding='utf-8')
    except (DataError, OSError, KeyError, yaml.YAMLError, csv.Error) as error:
        print(f'report_claims: {error}', file=sys.stderr)
        return 1
    print(f'{arguments.root / "claims.md"}: written')
    return 0


if __name__ == '__main__':
    sys.exit(main())
