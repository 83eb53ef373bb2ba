"""Style of the figures: colours, sizes, and a page of panels with its legend in a separate row."""
import math
import re
from typing import Any, Dict, List, Optional, Sequence, Tuple

import matplotlib
matplotlib.use('Agg')
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

# Okabe and Ito's colours, which colour-blind readers can tell apart; yellow last: faint on white.
COLOURS = {'blue': '#0072B2', 'vermillion': '#D55E00', 'green': '#009E73', 'purple': '#CC79A7', 'sky': '#56B4E9',
           'orange': '#E69F00', 'black': '#000000', 'yellow': '#F0E442'}
PREFERRED = {'DPSO': 'vermillion', 'PF-g': 'sky', 'PF-l': 'blue', 'adaptive': 'vermillion', 'not adaptive': 'blue',
             'without recovery': 'blue', 'paper recovery': 'vermillion', 'guided recovery': 'green',
             'adaptive, paper recovery': 'vermillion', 'adaptive, guided recovery': 'green',
             'hybrid': 'vermillion', 'SIFT': 'blue', 'WGII + WGOH': 'green', 'global': 'green',
             'DPSO + hybrid': 'orange', 'DPSO + SIFT': 'sky', 'DPSO + global': 'purple',
             'best single image': 'black', 'sequence matching': 'orange', 'topological Bayes filter': 'purple'}
STYLES: Tuple[Any, ...] = ('-', '--', ':', '-.', (0, (5, 1, 1, 1, 1, 1)))
PAPER_FILL, PAPER_EDGE = '#E3E3E3', '#7A7A7A'
PAPER_LINE = '#7A7A7A'
PAGE_WIDTH = 8.4

STYLE = {'font.size': 9, 'axes.titlesize': 9.5, 'figure.titlesize': 11, 'legend.fontsize': 8.5, 'axes.grid': True,
         'grid.alpha': .3, 'grid.linewidth': .6, 'axes.spines.top': False, 'axes.spines.right': False,
         'axes.axisbelow': True, 'hatch.linewidth': .6, 'lines.linewidth': 1.5, 'lines.markersize': 5,
         'figure.facecolor': 'white', 'savefig.dpi': 130,
         # The same data give the same file.
         'svg.hashsalt': 'visual_localization'}


def literal(text: str) -> str:
    """A name that matplotlib does not take for a formula."""
    return text.replace('$', r'\$')


def family(method: str) -> str:
    """The name without its number and without the kidnapping."""
    base = re.sub(r', kidnapped$', '', method)
    return re.sub(r'[-\s]+\d[\d.]*x?$', '', base)


class Palette:
    """A colour for each family of methods and a line style for each member, the same in every figure."""

    def __init__(self, methods: Sequence[str]):
        members: Dict[str, List[str]] = {}
        for method in methods:
            members.setdefault(family(method), []).append(re.sub(r', kidnapped$', '', method))
        # When two prefer the same colour, the first gets it.
        taken = dict((colour, name) for name, colour in reversed([(name, PREFERRED[name]) for name in members
                                                                  if name in PREFERRED]))
        free = [colour for colour in COLOURS if colour not in taken]
        self._colours: Dict[str, str] = {}
        self._styles: Dict[str, Any] = {}
        drawn: Dict[str, int] = {}  # line styles of a colour that are taken: more families than colours share them
        for name, inside in members.items():
            chosen = PREFERRED.get(name, '')
            if taken.get(chosen) != name:
                chosen = free.pop(0) if free else list(COLOURS)[len(self._colours) % len(COLOURS)]
            self._colours[name] = COLOURS[chosen]
            for method in dict.fromkeys(inside):
                self._styles[method] = STYLES[drawn.setdefault(chosen, 0) % len(STYLES)]
                drawn[chosen] += 1

    def colour(self, method: str) -> str:
        return self._colours.get(family(method), COLOURS['black'])

    def line(self, method: str) -> Dict[str, Any]:
        style = self._styles.get(re.sub(r', kidnapped$', '', method), '-')
        return {'color': self.colour(method), 'linestyle': style}

    def handles(self, methods: Sequence[str]) -> List[Line2D]:
        return [Line2D([], [], label=literal(method), **self.line(method)) for method in methods]


def paper_patch() -> Patch:
    return Patch(facecolor=PAPER_FILL, edgecolor=PAPER_EDGE, hatch='////', label='papers')


def page(title: str, rows: int, columns: int, panel_height: float, handles: Sequence[Any] = (),
         legend_width: Optional[int] = None, share_x: bool = False) -> Tuple[plt.Figure, List[plt.Axes]]:
    """A figure of equal panels, row by row, with the legend below them."""
    longest = max((len(handle.get_label()) for handle in handles), default=1)
    across = legend_width or max(1, min(len(handles), int(PAGE_WIDTH * 72 / (longest * 4.8 + 44))))
    # The same number in every row.
    across = math.ceil(len(handles) / math.ceil(len(handles) / across)) if handles else 1
    legend_height = .26 * math.ceil(len(handles) / across) + .05 if handles else 0
    heights = [panel_height] * rows + ([legend_height] if handles else [])
    figure = plt.figure(figsize=(PAGE_WIDTH, sum(heights) + .45), constrained_layout=True)
    grid = figure.add_gridspec(len(heights), columns, height_ratios=heights)
    axes: List[plt.Axes] = []
    for index in range(rows * columns):
        above = axes[index % columns] if share_x and index >= columns else None
        axes.append(figure.add_subplot(grid[index // columns, index % columns], sharex=above))
    if handles:
        below = figure.add_subplot(grid[-1, :])
        below.axis('off')
        below.legend(handles=handles, loc='center', ncol=across, frameon=False, borderaxespad=0)
    figure.suptitle(title)
    return figure, axes


def shape(count: int) -> Tuple[int, int]:
    columns = 1 if count == 1 else 3 if count in (3, 5, 6, 9) else 2
    return math.ceil(count / columns), columns


def hide_unused(axes: Sequence[plt.Axes], used: int) -> None:
    for axis in axes[used:]:
        axis.set_visible(False)
