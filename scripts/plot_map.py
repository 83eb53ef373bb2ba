#!/usr/bin/python3
"""Draws the fixes, cleaned paths and training images of a map's sessions. `map_builder --plot` calls it.

A panel for each session: kept fixes, dropped ones with shape and colour of the reason, the cleaned path, the training
images and, as faint dots, the landmarks. A session with landmarks was adjusted: its images need not lie on the cleaned
path, which is dashed. With several sessions also a panel with all paths. Metres, north up, one scale on both axes.
"""
import argparse
import io
import json
import math
import os
import sys
import warnings
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, NoReturn, Sequence, Tuple

sys.path.insert(0, str(Path(__file__).resolve().parent))
try:
    import numpy as np
    from evaluation_report.data import DataError
    from evaluation_report.files import written_whole
    from evaluation_report.style import COLOURS, PAGE_WIDTH, STYLE, literal, plt
    from matplotlib.lines import Line2D
except ImportError as error:
    sys.exit(f'plot_map: {error}: install python3-matplotlib, python3-numpy and python3-yaml')

ENDINGS = ('.png', '.svg', '.pdf')
SESSION_COLOURS = [COLOURS[name] for name in ('blue', 'vermillion', 'green', 'purple', 'orange', 'sky')]
# The verdicts in drawing order: how their fixes look, and what the legend says of them.
VERDICTS: Dict[str, Tuple[Dict[str, Any], str]] = {
    'kept': ({'marker': 'o', 'color': '#c4c4c4', 'markersize': 4.5, 'markeredgewidth': 0}, 'kept'),
    'multipath': ({'marker': '^', 'color': COLOURS['orange'], 'markersize': 4.5, 'markeredgewidth': 0}, 'multipath'),
    'no fix': ({'marker': 'o', 'color': 'black', 'markersize': 5, 'markerfacecolor': 'none', 'markeredgewidth': .6},
               'no fix, drawn on the path'),
    'out of order': ({'marker': 's', 'color': '#9467bd', 'markersize': 4.5, 'markeredgewidth': 0}, 'out of order'),
    'spike': ({'marker': 'x', 'color': '#d62728', 'markersize': 6, 'markeredgewidth': 1.8}, 'spikes (single outliers)'),
}
LANDMARK_LOOK: Dict[str, Any] = {'marker': '.', 'color': '#7a9a7a', 'markersize': 1.6, 'markeredgewidth': 0}
# Inches. Beside a panel its legend; above it the title, below it the labels of the axis.
LEFT, PANEL, LEGEND, ABOVE, BELOW = .6, 5.4, 2.4, .4, .5
LINE = .215
# A picture that is wider or higher has more pixels than matplotlib draws.
MOST_PIXELS = 65000

Positions = np.ndarray  # one row a position: east, north in metres


class Session(NamedTuple):
    """One session as map_builder describes it."""
    name: str
    fixes: Dict[str, Positions]
    counts: Dict[str, int]  # a fix before the path begins has no position
    paths: List[Positions]
    images: Positions
    landmarks: Positions  # none: places only
    length_m: float
    gaps_closed: int


class Area(NamedTuple):
    """The part of the map frame that a panel shows."""
    low: np.ndarray
    high: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """East and north, metres."""
        return self.high - self.low

    def clipped(self, positions: Positions) -> Positions:
        """What lies outside, put on the border."""
        return np.clip(positions, self.low, self.high)


def read_sessions(path: Path) -> List[Session]:
    """From the JSON file of map_builder (src/apps/map_export.h)."""
    def positions(rows: Sequence[Sequence[float]]) -> Positions:
        return np.array(rows, dtype=float).reshape(-1, 2)

    try:
        data = json.loads(path.read_text(encoding='utf-8'))
        return [Session(one['name'], {verdict: positions(one['fixes'][verdict]['positions_m']) for verdict in VERDICTS},
                        {verdict: int(one['fixes'][verdict]['count']) for verdict in VERDICTS},
                        [positions(part) for part in one['paths_m']], positions(one['images_m']),
                        positions(one['landmarks_m']), float(one['length_m']), int(one['gaps_closed'])) for one in data['sessions']]
    except OSError as failure:
        raise DataError(path, f'cannot be read: {failure.strerror}') from failure
    except (ValueError, KeyError, TypeError) as failure:
        raise DataError(path, f'is not what map_builder writes: {failure!r}') from failure


def area_of(sessions: Sequence[Session]) -> Area:
    """All paths, with room for multipath beside them."""
    paths = np.vstack([part for session in sessions for part in session.paths])
    low, high = paths.min(axis=0), paths.max(axis=0)
    extent = max((high - low).max(), 5.0)
    multipath = np.vstack([session.fixes['multipath'] for session in sessions])
    shown = np.vstack([paths, np.clip(multipath, low - .2 * extent, high + .2 * extent)])
    low, high = shown.min(axis=0) - .06 * extent, shown.max(axis=0) + .06 * extent
    # A street that runs due east is no strip, and one that runs due north no tower.
    east, north = high - low
    missing = np.maximum([1.1 * north - east, .35 * east - north], 0)
    return Area(low - .5 * missing, high + .5 * missing)


def area_for(session: Session, together: Area) -> Area:
    """Sessions of one area are shown alike; one that is small beside all of them is shown alone."""
    alone = area_of([session])
    return together if together.size.max() <= 4 * alone.size.max() else alone


def step_below(most: float) -> float:
    """1, 2 or 5 times a power of ten: the largest that is not above `most`."""
    power = 10.0 ** math.floor(math.log10(most))
    return power * max(factor for factor in (1, 2, 5) if factor * power <= most * (1 + 1e-9))


def shown_name(name: str, most: int) -> str:
    """A session's name for a title; of a long one the end, because there the names of one area differ."""
    printable = ''.join(letter if letter.isprintable() else '?' for letter in name)
    return literal(printable if len(printable) <= most else '...' + printable[3 - most:])


class Page:
    """Panels below each other, each with its legend to the right."""

    def __init__(self, areas: Sequence[Area], legend_lines: Sequence[int]):
        self._areas = areas
        self._heights = [PANEL * area.size[1] / area.size[0] for area in areas]
        blocks = [ABOVE + max(height + BELOW, LINE * lines) for height, lines in zip(self._heights, legend_lines)]
        self._tops = [sum(blocks[:index]) + ABOVE for index in range(len(blocks))]
        self._height = sum(blocks)
        self.figure = plt.figure(figsize=(PAGE_WIDTH, self._height))

    def panel(self, index: int, title: str) -> plt.Axes:
        """Frame, grid and ticks in metres, a bar for the scale and an arrow to the north."""
        area, height = self._areas[index], self._heights[index]
        axes = self.figure.add_axes([LEFT / PAGE_WIDTH, 1 - (self._tops[index] + height) / self._height,
                                     PANEL / PAGE_WIDTH, height / self._height])
        axes.set_xlim(area.low[0], area.high[0])
        axes.set_ylim(area.low[1], area.high[1])
        step = step_below(area.size.max() / 5)
        axes.xaxis.set_major_locator(plt.MultipleLocator(step))
        axes.yaxis.set_major_locator(plt.MultipleLocator(step))
        axes.set_xlabel('east of the datum [m]')
        axes.set_ylabel('north [m]')
        axes.set_title(title, loc='left', fontweight='bold')
        for side in ('top', 'right'):
            axes.spines[side].set_visible(True)
        self._draw_scale(axes, area)
        axes.annotate('N', xy=(.96, .98), xytext=(.96, .86), xycoords='axes fraction', ha='center', va='center',
                      arrowprops={'arrowstyle': '-|>', 'color': 'black'})
        return axes

    @staticmethod
    def _draw_scale(axes: plt.Axes, area: Area) -> None:
        length = step_below(area.size[0] / 4)
        right, bottom = area.high[0] - .02 * area.size[0], area.low[1] + .02 * area.size[0]
        tick = .01 * area.size[0]
        axes.plot([right - length, right - length, right, right], [bottom + tick, bottom, bottom, bottom + tick],
                  color='black', linewidth=1.2)
        axes.text(right - length / 2, bottom + tick, f'{length:g} m', ha='center', va='bottom')

    @staticmethod
    def legend(axes: plt.Axes, handles: Sequence[Line2D], title: str, note: str) -> None:
        """To the right of the panel, between title and note. What there is none of is grey."""
        first, last = (Line2D([], [], linestyle='none', label=label) for label in (title, note))
        texts = axes.legend(handles=[first, *handles, last], loc='upper left', bbox_to_anchor=(1.01, 1.02),
                            frameon=False, borderaxespad=0).get_texts()
        for text in texts:
            text.set_color('#999999' if text.get_text().startswith('0 ') else 'black')
        texts[0].set_fontweight('bold')
        texts[-1].set(color='#555555', fontsize=8)


def draw_points(axes: plt.Axes, positions: Positions, look: Dict[str, Any], name: str) -> None:
    """Marks, as one group of this name in an SVG file."""
    if len(positions):
        axes.plot(positions[:, 0], positions[:, 1], linestyle='none', gid=name.replace(' ', '_'), clip_on=False, **look)


def draw_path(axes: plt.Axes, session: Session, area: Area, colour: str) -> None:
    """A line for each part: where a path was left open, nothing was driven as far as the map knows."""
    for part in session.paths:
        axes.plot(*area.clipped(part).T, color=colour, linewidth=1.3, **path_look(session))


def path_look(session: Session) -> Dict[str, Any]:
    """Dashed where the adjustment took another one."""
    return {'linestyle': '--' if len(session.landmarks) else '-'}


def image_look(colour: str) -> Dict[str, Any]:
    return {'marker': 'o', 'markersize': 2.6, 'markeredgewidth': .6, 'markerfacecolor': 'white', 'color': colour}


def inside(area: Area, positions: Positions) -> Positions:
    return positions[((positions >= area.low) & (positions <= area.high)).all(axis=1)]


def draw_session(page: Page, index: int, session: Session, area: Area) -> None:
    colour = SESSION_COLOURS[index % len(SESSION_COLOURS)]
    axes = page.panel(index, shown_name(session.name, 50))
    handles = []
    draw_points(axes, inside(area, session.landmarks), LANDMARK_LOOK, f'landmarks_{index}')
    for verdict, (look, meaning) in VERDICTS.items():
        draw_points(axes, area.clipped(session.fixes[verdict]), look, f'{verdict}_{index}')
        handles.append(Line2D([], [], linestyle='none', label=f'{session.counts[verdict]} {meaning}', **look))
        if verdict == 'kept':  # the others lie on top of path and images
            draw_path(axes, session, area, colour)
            draw_points(axes, area.clipped(session.images), image_look(colour), f'images_{index}')
    images = f'{len(session.images)} training images' + (', adjusted' if len(session.landmarks) else '')
    handles += [Line2D([], [], color=colour, label=f'cleaned path, {session.length_m:.0f} m', **path_look(session)),
                Line2D([], [], linestyle='none', label=images, **image_look(colour)),
                Line2D([], [], linestyle='none', label=f'{session.gaps_closed} gaps closed')]
    if len(session.landmarks):
        handles.append(Line2D([], [], linestyle='none', label='landmarks', **LANDMARK_LOOK))
    page.legend(axes, handles, f'{sum(session.counts.values())} fixes', 'Marks on the border lie outside.')


def draw_together(page: Page, index: int, sessions: Sequence[Session], area: Area) -> None:
    axes = page.panel(index, 'all sessions, cleaned paths')
    handles = []
    for number, session in enumerate(sessions):
        colour = SESSION_COLOURS[number % len(SESSION_COLOURS)]
        draw_path(axes, session, area, colour)
        start = {'marker': 'o', 'color': colour, 'markersize': 5}
        draw_points(axes, area.clipped(session.paths[0][:1]), start, f'start_{number}')
        handles.append(Line2D([], [], color=colour, linewidth=2.5, label=shown_name(session.name, 26)))
    page.legend(axes, handles, f'{len(sessions)} sessions', 'A dot is where a path begins.')


def draw(sessions: Sequence[Session]) -> plt.Figure:
    together = area_of(sessions)
    areas = [area_for(session, together) for session in sessions]
    lines = [len(VERDICTS) + 6] * len(sessions)
    if len(sessions) > 1:
        areas.append(together)
        lines.append(len(sessions) + 2)
    page = Page(areas, lines)
    for index, session in enumerate(sessions):
        draw_session(page, index, session, areas[index])
    if len(sessions) > 1:
        draw_together(page, len(sessions), sessions, together)
    return page.figure


def save(figure: plt.Figure, path: Path) -> None:
    picture, kind = io.BytesIO(), path.suffix[1:].lower()
    metadata = {'svg': {'Date': None}, 'pdf': {'CreationDate': None}}.get(kind)
    dpi = min(plt.rcParams['savefig.dpi'], MOST_PIXELS / max(figure.get_size_inches()))
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', message='Glyph')  # a name in letters that the font lacks
        figure.savefig(picture, format=kind, dpi=dpi, metadata=metadata)
    with written_whole(Path(os.path.realpath(path))) as partial:
        partial.write_bytes(picture.getvalue())


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with the arguments."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f'plot_map: {message}\n')


def picture_path(text: str) -> Path:
    """A path of a format that is written."""
    path = Path(text)
    if path.suffix.lower() not in ENDINGS:
        raise argparse.ArgumentTypeError(f'{text} does not end in .png, .svg or .pdf')
    return path


def main() -> int:
    """Exit code 0, or 1 with one line when a file is not as it should be."""
    parser = Parser(prog='plot_map.py', description=(__doc__ or '').splitlines()[0])
    parser.add_argument('data', type=Path, metavar='DATA', help='JSON file that map_builder wrote')
    parser.add_argument('picture', type=picture_path, metavar='PICTURE', help='PNG, SVG or PDF to write, by its ending')
    arguments = parser.parse_args()
    try:
        sessions = read_sessions(arguments.data)
        with plt.rc_context(STYLE):
            save(draw(sessions), arguments.picture)
    except DataError as failure:
        print(f'plot_map: {failure}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
