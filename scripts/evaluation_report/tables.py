"""The report's tables, in Markdown: ours beside the papers'."""
import math
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Set

import numpy as np

from .data import Group, Number, Outcome, Results, plain
from .experiments import (CHANGING, CONSTANT, HYBRID, GridPoint, by_illumination, grid_point, group_title,
                          speed_of, thresholds_of)
from .papers import PaperValue, Papers
from .reliability import pooled


class Measure(NamedTuple):
    """A column: its title and number format."""
    metric: str
    title: str
    decimals: int
    scale: float = 1.0
    spread: Optional[str] = None


MAIN = (Measure('mean_err_m', 'mean error [m]', 2, spread='std_err_m'),
        Measure('comparisons_per_image', 'comparisons per image', 1),
        Measure('ms_per_image', 'time per image [ms]', 1),
        Measure('sift_share', 'SIFT steps [%]', 2, 100))
COST = (Measure('sift_share', 'SIFT steps [%]', 2, 100),
        Measure('s_per_image', 'time per image [s]', 4),
        Measure('speed_up', 'speed-up over SIFT', 2))
TRACKING = (Measure('runs', 'runs', 0),
            Measure('median_err_m', 'median error [m]', 2),
            Measure('within_5m', 'within 5 m [%]', 1, 100),
            Measure('steps_to_localise', 'images until localised', 1),
            Measure('steps_to_localise_p95', 'of 95 % of the runs', 1),
            Measure('steps_to_relocalise', 'images until relocalised', 1),
            Measure('steps_to_relocalise_p95', 'of 95 % of the runs', 1),
            Measure('recall_at_p99', 'recall at 99 % precision [%]', 1, 100),
            Measure('extract_ms', 'extract [ms]', 2),
            Measure('match_ms', 'match [ms]', 2),
            Measure('update_ms', 'update [ms]', 2))
TRUST = (Measure('tracking_share', 'TRACKING [%]', 1, 100),
         Measure('wrong_tracking', 'TRACKING beyond 5 m [%]', 2, 100),
         Measure('lost_precision', '"lost": precision [%]', 1, 100),
         Measure('lost_recall', '"lost": recall [%]', 1, 100))
OFF_MAP = (Measure('off_map_precision', 'OFF_MAP: precision [%]', 1, 100),
           Measure('off_map_recall', 'OFF_MAP: recall [%]', 1, 100))
POSES = (Measure('metric_share', 'METRIC [%]', 1, 100),
         Measure('mean_err_m', 'mean error [m]', 2),
         Measure('p95_err_m', '95 % error [m]', 2),
         Measure('heading_err_deg', 'heading error [°]', 2),
         Measure('recall_025m_2deg', '(0.25 m, 2°) [%]', 1, 100),
         Measure('recall_05m_5deg', '(0.5 m, 5°) [%]', 1, 100),
         Measure('recall_5m_10deg', '(5 m, 10°) [%]', 1, 100),
         Measure('wrong_1m_share', 'TRACKING and beyond 1 m [%]', 2, 100),
         Measure('wrong_5m_share', 'TRACKING and beyond 5 m [%]', 2, 100),
         Measure('inside_95_share', 'inside the 95 % ellipse [%]', 1, 100),
         Measure('nees', 'NEES', 2))
RELATIVE_POSES = (Measure('relative_err_m', 'mean error [m]', 2),
                  Measure('relative_p95_err_m', '95 % error [m]', 2),
                  Measure('relative_heading_err_deg', 'heading error [°]', 2),
                  Measure('relative_recall_025m_2deg', '(0.25 m, 2°) [%]', 1, 100),
                  Measure('relative_recall_05m_5deg', '(0.5 m, 5°) [%]', 1, 100),
                  Measure('relative_recall_5m_10deg', '(5 m, 10°) [%]', 1, 100),
                  Measure('relative_nees', 'NEES', 2))
FILTERED_POSES = (Measure('filtered_err_m', 'mean error [m]', 2),
                  Measure('filtered_inside_95_share', 'inside the 95 % ellipse [%]', 1, 100),
                  Measure('filtered_nees', 'NEES', 2),
                  Measure('relative_filtered_err_m', 'to the map: mean error [m]', 3),
                  Measure('relative_filtered_inside_95_share', 'inside the 95 % ellipse [%]', 1, 100),
                  Measure('relative_filtered_nees', 'NEES', 2))
CLAIMS = (Measure('right_share', 'right [%]', 1, 100),
          Measure('tracking_share', 'TRACKING [%]', 1, 100),
          Measure('wrong_claims', 'wrong of these [%]', 2, 100),
          Measure('comparisons_per_image', 'comparisons per image', 1),
          Measure('steps_to_localise', 'images until localised', 1))
ERROR, COMPARISONS = MAIN[:2]
NOTHING = '–'


def escape(text: object) -> str:
    """Text that stays in its cell, and that a browser does not run."""
    return plain(str(text)).replace('\\', '\\\\').replace('|', '\\|')


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose first column is text and whose others are numbers."""
    lines = [header, ['---'] + ['---:'] * (len(header) - 1), *rows]
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines) + '\n'


def written(value: Number, decimals: int, scale: float = 1.0) -> str:
    """A formatted number; a dash when there is none."""
    return NOTHING if value is None else f'{value * scale:.{decimals}f}'


def ours(outcome: Outcome, measure: Measure) -> str:
    """Our number, with its standard deviation where the measure has one."""
    text = written(outcome.get(measure.metric), measure.decimals, measure.scale)
    spread = outcome.get(measure.spread) if measure.spread else None
    return text if spread is None or text == NOTHING else f'{text} ± {written(spread, measure.decimals, measure.scale)}'


class PaperColumn:
    """Cells with the papers' numbers; collects their sources for the line under the table."""

    def __init__(self, papers: Papers, experiment: str):
        self._papers = papers
        self._experiment = experiment
        self._used: Set[int] = set()

    def cell(self, group: Group, method: str, measure: Measure) -> str:
        """The leading source's number; after a slash the differing number of another source."""
        values = self._papers.differing(self._experiment, group, method, measure.metric)
        return ' / '.join(self._written(value, group, method, measure) for value in values) or NOTHING

    def _written(self, value: PaperValue, group: Group, method: str, measure: Measure) -> str:
        mark = self._papers.sources(self._experiment).index(value.source) + 1
        self._used.add(mark)
        text = self._number(value, measure)
        if measure.spread:
            spreads = self._papers.all(self._experiment, group, method, measure.spread)
            own = next((spread for spread in spreads if spread.source == value.source), None)
            text += f' ± {self._number(own, measure)}' if own else ''
        return f'{text} <sup>{mark}</sup>'

    @staticmethod
    def _number(value: PaperValue, measure: Measure) -> str:
        return value.text if measure.scale == 1 else f'{value.value * measure.scale:.{measure.decimals}f}'

    def sources(self) -> str:
        known = self._papers.sources(self._experiment)
        listed = '; '.join(f'<sup>{mark}</sup> {known[mark - 1]}' for mark in sorted(self._used))
        return f'\nPapers: {listed}.\n' if listed else ''


def outcome_table(experiment: str, outcomes: List[Outcome], measures: Sequence[Measure], papers: Papers) -> str:
    """One row per method; empty columns are omitted."""
    column = PaperColumn(papers, experiment)
    header, cells = ['method'], [[escape(outcome.method)] for outcome in outcomes]
    for measure in measures:
        own = [ours(outcome, measure) for outcome in outcomes]
        theirs = [column.cell(outcome.group, outcome.method, measure) for outcome in outcomes]
        for title, texts in ((measure.title, own), (f'{measure.title} (papers)', theirs)):
            if any(text != NOTHING for text in texts):
                header.append(title)
                for row, text in zip(cells, texts):
                    row.append(text)
    return markdown(header, cells) + column.sources()


def group_tables(results: Results, papers: Papers, measures: Sequence[Measure]) -> str:
    """One table per pair of groups, each under its heading."""
    return '\n'.join(f'### {escape(group_title(group))}\n\n'
                     + outcome_table(results.experiment, results.of(group), measures, papers)
                     for group in results.groups())


def grid_of(outcomes: Dict[str, Outcome], row_title: str, rows: Dict[str, Dict[str, str]], columns: List[str],
            column: Optional[PaperColumn], measure: Measure = ERROR) -> str:
    """A table of a measure over two settings; rows and columns name the method in each cell."""
    lines = []
    for title, methods in rows.items():
        cells = [outcomes.get(methods.get(name, '')) for name in columns]
        if column:
            texts = [column.cell(cell.group, cell.method, measure) if cell else NOTHING for cell in cells]
        else:
            texts = [ours(cell, measure._replace(spread=None)) if cell else NOTHING for cell in cells]
        lines.append([title, *texts])
    return markdown([row_title, *columns], lines)


def speed_table(results: Results, papers: Papers) -> str:
    """Mean error over simulated speed, adaptive or not ([C] Table I)."""
    text = ''
    for group in results.groups():
        column = PaperColumn(papers, results.experiment)
        variants: Dict[str, Dict[float, Outcome]] = {}
        for outcome in results.of(group):
            speed = speed_of(outcome.method)
            if speed:
                variants.setdefault(speed[0], {})[speed[1]] = outcome
        header = ['simulated speed', *(f'{variant}{whose}' for variant in variants for whose in ('', ' (papers)'))]
        rows = []
        for speed_value in sorted({value for cells in variants.values() for value in cells}):
            row = [f'{speed_value:g} x']
            for cells in variants.values():
                cell = cells.get(speed_value)
                row += [ours(cell, ERROR), column.cell(group, cell.method, ERROR)] if cell else [NOTHING, NOTHING]
            rows.append(row)
        if rows:
            text += (f'### Mean error [m], {escape(group_title(group))}\n\n' + markdown(header, rows)
                     + column.sources() + '\n')
    return text


def motion_tables(results: Results, papers: Papers) -> str:
    """The motion grid in the shape of [J] Table 3, ours and the papers'."""
    text = ''
    for group in results.groups():
        outcomes = {outcome.method: outcome for outcome in results.of(group) if grid_point(outcome.method)}
        if not outcomes:
            continue
        points = {method: grid_point(method) for method in outcomes}
        columns = sorted({(point.rotation_deg, point.speed) for point in points.values()})
        rows: Dict[str, Dict[str, str]] = {}
        for method, point in sorted(points.items(), key=lambda item: -item[1].acceleration):
            rows.setdefault(f'{point.acceleration:g}', {})[column_title(point)] = method
        titles = [f'{rotation:g}°, {speed:g} v_R' for rotation, speed in columns]
        column = PaperColumn(papers, results.experiment)
        title = escape(group_title(group))
        text += f'### Mean error [m], {title}, ours\n\n' + grid_of(outcomes, 'σ_acc', rows, titles, None) + '\n'
        theirs = grid_of(outcomes, 'σ_acc', rows, titles, column)
        if column.sources():
            text += f'### Mean error [m], {title}, papers\n\n' + theirs + column.sources() + '\n'
        text += (f'### Comparisons per image, {title}, ours\n\n'
                 + grid_of(outcomes, 'σ_acc', rows, titles, None, COMPARISONS) + '\n')
    return text


def column_title(point: GridPoint) -> str:
    """Heading of a grid point's column."""
    return f'{point.rotation_deg:g}°, {point.speed:g} v_R'


def threshold_tables(results: Results, papers: Papers) -> str:
    """Error and SIFT share over the thresholds ([H] Fig. 4 f, of which the paper prints no numbers)."""
    text = ''
    for group in results.groups():
        rows = []
        for outcome in results.of(group):
            thresholds = thresholds_of(results, outcome.method)
            limits = [f'{value:g}' for value in thresholds] if thresholds else [NOTHING, NOTHING]
            rows.append([escape(outcome.method), *limits, *(ours(outcome, measure) for measure in MAIN)])
        header = ['method', 'd_global [m]', 'd_SIFT [m]', *(measure.title for measure in MAIN)]
        text += f'### {escape(group_title(group))}\n\n' + markdown(header, rows) + '\n'
    return text


def cost_tables(results: Results, papers: Papers) -> str:
    """The hybrid's tables: errors per pair of groups, then cost by illumination ([H] Tables I and II)."""
    text = group_tables(results, papers, MAIN)
    merged = by_illumination(results)
    for group in (CONSTANT, CHANGING):
        rows = [outcome for outcome in merged if outcome.group == group]
        if rows:
            text += (f'\n### Cost under {group_title(group)}\n\n'
                     + outcome_table(results.experiment, rows, COST, papers))
    return text


SHAPES: Dict[str, Callable[[Results, Papers], str]] = {
    'speed': speed_table, 'motion_grid': motion_tables, 'thresholds': threshold_tables,
    **dict.fromkeys(HYBRID, cost_tables)}


def result_tables(results: Results, papers: Papers) -> str:
    """The experiment's tables in the papers' layout; the general table when no method fits it."""
    shaped = SHAPES.get(results.experiment, lambda *_: '')(results, papers)
    return (shaped or group_tables(results, papers, MAIN)).rstrip() + '\n'


def claims_tables(results: Results) -> str:
    """What is right and what is wrongly claimed, where the experiment says what that is."""
    rounds = results.description.get('rounds')
    rounds = rounds if isinstance(rounds, dict) else {}
    bags = [bag for bag in rounds.get('bags') or [] if isinstance(bag, dict)]
    if not any('right' in part or 'wrong' in part for part in [rounds, *bags]):
        return ''
    return group_tables(results, Papers(None), CLAIMS)


def swarm_speed_table(results: Results) -> str:
    """Speed of the swarm (EMA) and of the robot in the runs of traces.csv; the papers expect them to agree."""
    rows = []
    for (train, test), runs in results.traces.items():
        for method, series in runs.items():
            pairs = [(swarm, robot) for swarm, robot in zip(series.columns.get('swarm_mps', []),
                                                            series.columns.get('robot_mps', []))
                     if math.isfinite(swarm) and math.isfinite(robot)]
            if len(pairs) < 2:
                continue
            swarm, robot = np.array(pairs).T
            varies = swarm.std() > 0 and robot.std() > 0
            rows.append([escape(f'{train} → {test}'), escape(method), f'{swarm.mean():.2f}', f'{robot.mean():.2f}',
                         f'{np.corrcoef(swarm, robot)[0, 1]:.2f}' if varies else NOTHING])
    return markdown(['map → drive', 'method', 'swarm [m/s]', 'robot [m/s]', 'correlation'], rows) if rows else ''


def reliability_table(results: Results) -> str:
    """Images and share that is not wrong, by the probability around the estimate; empty without one."""
    methods = {method: pooled([claim for claim in results.claims if claim.method == method])
               for method in results.methods()}
    begins = sorted({claim.begin for claim in results.claims})
    if not begins:
        return ''
    names = [f'{begin:g} to {end:g}' for begin, end in zip(begins, begins[1:] + [1])]
    rows = []
    for method, bins in methods.items():
        cells = {claim.begin: f'{100 * claim.not_wrong:.1f} ({claim.images:.0f})' for claim in bins}
        if cells:
            rows.append([escape(method), *(cells.get(begin, NOTHING) for begin in begins)])
    return markdown(['method', *names], rows)


def tracking_tables(results: Results) -> str:
    """Measures that the papers do not have."""
    return group_tables(results, Papers(None), TRACKING)


def pose_tables(results: Results) -> str:
    """Recall and what the poses claim; empty without true headings."""
    if all(outcome.get('heading_err_deg') is None for outcome in results.outcomes):
        return ''
    return group_tables(results, Papers(None), POSES)


def relative_tables(results: Results) -> str:
    """The same in relation to the map; empty without true headings of its images."""
    if all(outcome.get('relative_heading_err_deg') is None for outcome in results.outcomes):
        return ''
    return group_tables(results, Papers(None), RELATIVE_POSES)


def filtered_tables(results: Results) -> str:
    """Behind a filter; empty when no method solves poses."""
    if all(outcome.get('filtered_err_m') is None for outcome in results.outcomes):
        return ''
    return group_tables(results, Papers(None), FILTERED_POSES)


def trust_tables(results: Results) -> str:
    """How reliable the trackers' states are; empty when no method has states."""
    outcomes = [outcome for group in results.groups() for outcome in results.of(group)]
    if all(outcome.get('tracking_share') is None for outcome in outcomes):
        return ''
    left = any(outcome.get('off_map_recall') is not None for outcome in outcomes)  # the robot, the map
    return group_tables(results, Papers(None), TRUST + OFF_MAP if left else TRUST)
