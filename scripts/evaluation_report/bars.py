"""Bar charts: a measure of every method, the papers' number below ours."""
from typing import Any, Dict, List, Optional, Sequence, Tuple

from matplotlib.patches import Patch

from .data import Number, Outcome, Results
from .experiments import CHANGING, CONSTANT, by_illumination, group_title
from .papers import Papers
from .style import PAGE_WIDTH, PAPER_EDGE, PAPER_FILL, Palette, hide_unused, literal, page, paper_patch, plt

WHISKERS = {'elinewidth': .9, 'capsize': 2.2, 'ecolor': '#333333'}


class Bar:
    """One number with its standard deviation."""

    def __init__(self, value: Number, spread: Number = None, scale: float = 1):
        self.value = None if value is None else value * scale
        self.spread = None if spread is None else spread * scale

    def end(self) -> float:
        return (self.value or 0) + (self.spread or 0)


Rows = Sequence[Tuple[str, Sequence[Tuple[Bar, Dict[str, Any]]]]]


def draw_bar(axis: plt.Axes, position: float, bar: Bar, thickness: float, decimals: int, style: Dict[str, Any]) -> None:
    """A horizontal bar, its whisker, and its number."""
    axis.barh(position, bar.value, thickness, **style)
    if bar.spread is not None:
        # No measure is below zero, so neither is a whisker.
        low = min(bar.spread, bar.value)
        axis.errorbar(bar.value, position, xerr=[[low], [bar.spread]], fmt='none', **WHISKERS)
    axis.annotate(f'{bar.value:.{decimals}f}', (bar.end(), position), xytext=(4, 0), textcoords='offset points',
                  va='center', fontsize=7.5, color='#333333', annotation_clip=False)


def draw_panel(axis: plt.Axes, rows: Rows, decimals: int, named: bool) -> None:
    """One row per method with its bars; a dash when there are none. The first method is on top."""
    thickness = .8 / max((len(bars) for _, bars in rows), default=1)
    for index, (_, bars) in enumerate(rows):
        defined = [(bar, style) for bar, style in bars if bar.value is not None]
        for slot, (bar, style) in enumerate(defined):
            offset = (slot - (len(defined) - 1) / 2) * thickness
            draw_bar(axis, index + offset, bar, thickness * .92, decimals, style)
        if not defined:
            axis.annotate('–', (0, index), xytext=(4, 0), textcoords='offset points', va='center', fontsize=7.5,
                          color='#333333')
    axis.set_xlim(0, longest(rows) * 1.17 or 1)
    axis.set_ylim(len(rows) - .4, -.6)
    axis.set_yticks(range(len(rows)))
    axis.set_yticklabels([literal(name) for name, _ in rows] if named else [])
    axis.tick_params(axis='y', length=0)
    axis.grid(axis='y', visible=False)


def longest(rows: Rows) -> float:
    return max((bar.end() for _, bars in rows for bar, _ in bars), default=0)


def panel_columns(count: int, names: Sequence[str]) -> int:
    """How many panels fit side by side, beside the longest name."""
    room = PAGE_WIDTH - .068 * max(map(len, names), default=0)
    return max(1, min(count, 3 if count != 4 else 2, int(room / 1.9)))


def bars_figure(results: Results, papers: Papers, palette: Palette, title: str, metric: str, label: str, decimals: int,
                spread: Optional[str] = None, scale: float = 1) -> Optional[plt.Figure]:
    """A measure by method, one panel per pair of groups; None when nothing is defined."""
    panels: List[Tuple[str, List[Tuple[str, List[Tuple[Bar, Dict[str, Any]]]]]]] = []
    with_papers = False
    for group in results.groups():
        rows = []
        for outcome in results.of(group):
            bars = [(Bar(outcome.get(metric), outcome.get(spread) if spread else None, scale),
                     {'color': palette.colour(outcome.method)})]
            rows.append((outcome.method, bars))
        theirs = [paper_bar(results, papers, outcome, metric, spread, scale) for outcome in results.of(group)]
        if any(bar.value is not None for bar in theirs):
            with_papers = True
            for (_, bars), bar in zip(rows, theirs):
                bars.append((bar, {'facecolor': PAPER_FILL, 'edgecolor': PAPER_EDGE, 'hatch': '////', 'linewidth': .6}))
        if any(bar.value is not None for _, bars in rows for bar, _ in bars[:1]):
            panels.append((group_title(group), rows))
    if not panels:
        return None
    names = [name for _, rows in panels for name, _ in rows]
    columns = panel_columns(len(panels), names)
    lines = -(-len(panels) // columns)
    furthest = max(longest(rows) for _, rows in panels)
    most = max(len(rows) for _, rows in panels)
    handles = [Patch(facecolor='#555555', label='here'), paper_patch()] if with_papers else []
    figure, axes = page(title, lines, columns, .75 + most * (.37 if with_papers else .25), handles)
    for index, (axis, (name, rows)) in enumerate(zip(axes, panels)):
        same = index % columns and [row[0] for row in rows] == [row[0] for row in panels[index - 1][1]]
        draw_panel(axis, rows, decimals, not same)
        axis.set(title=literal(name), xlabel=label, xlim=(0, furthest * 1.17 or 1))
    hide_unused(axes, len(panels))
    return figure


def paper_bar(results: Results, papers: Papers, outcome: Outcome, metric: str, spread: Optional[str],
              scale: float) -> Bar:
    value, deviation = (papers.lead(results.experiment, outcome.group, outcome.method, name) if name else None
                        for name in (metric, spread))
    return Bar(value, deviation, scale)


def cost_figure(results: Results, papers: Papers, palette: Palette, title: str) -> Optional[plt.Figure]:
    """Time per image by illumination, here and in the paper; the computers differ too much for one axis."""
    merged = by_illumination(results)
    methods = list(dict.fromkeys(outcome.method for outcome in merged))
    known = {(outcome.group, outcome.method): outcome for outcome in merged}
    looks: Tuple[Tuple[Any, float], ...] = ((CONSTANT, 1), (CHANGING, .5))
    here, there = [], []
    for method in methods:
        style = {'color': palette.colour(method)}
        own = [known[group, method].get('ms_per_image') if (group, method) in known else None for group, _ in looks]
        theirs = [papers.lead(results.experiment, group, method, 's_per_image') for group, _ in looks]
        here.append((method, [(Bar(value), dict(style, alpha=alpha)) for value, (_, alpha) in zip(own, looks)]))
        there.append((method, [(Bar(value), {'facecolor': PAPER_FILL, 'edgecolor': PAPER_EDGE, 'alpha': alpha,
                                             'hatch': '////', 'linewidth': .6})
                               for value, (_, alpha) in zip(theirs, looks)]))
    if not any(bar.value is not None for _, bars in here for bar, _ in bars):
        return None
    with_papers = any(bar.value is not None for _, bars in there for bar, _ in bars)
    handles = [Patch(facecolor='#555555', alpha=alpha, label=group_title(group)) for group, alpha in looks]
    figure, axes = page(title, 1, 2 if with_papers else 1, .7 + .4 * len(methods), handles)
    draw_panel(axes[0], here, 1, True)
    axes[0].set(title='here', xlabel='time per image [ms]')
    if with_papers:
        draw_panel(axes[1], there, 2, False)
        axes[1].set(title='papers', xlabel='time per image [s]')
    return figure
