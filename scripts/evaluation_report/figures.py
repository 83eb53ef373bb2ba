"""Which figures an experiment gets, and how they are written."""
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, List, Optional, Tuple

from .bars import bars_figure, cost_figure
from .curves import (counts_figure, diversity_figure, diversity_parts, kidnapped_figure, runs_figure, speed_figure,
                     steps_figure, thresholds_figure)
from .data import Results
from .experiments import HYBRID
from .files import written_whole
from .grids import motion_figure
from .papers import Papers
from .reliability import reliability_figure
from .style import STYLE, Palette, literal, plt

# With more methods than this, bars are unreadable; such experiments have other figures.
MOST_BARS = 24


@dataclass(frozen=True)
class Drawing:
    """A figure that may turn out to be empty."""
    name: str
    caption: str
    draw: Callable[[str], Optional[plt.Figure]]


class Figures:
    """The figures of one report."""

    def __init__(self, results: Results, papers: Papers):
        self._results = results
        self._papers = papers
        self._palette = Palette(results.methods())

    def write(self, folder: Path, file_format: str) -> List[Tuple[str, str]]:
        """Draws every figure that has data; returns file names and captions."""
        written = []
        with plt.rc_context(STYLE):
            for drawing in self.drawings():
                figure = drawing.draw(literal(drawing.caption))
                if figure is None:
                    continue
                name = f'{drawing.name}.{file_format}'
                # A date would change the file at every run.
                metadata = {'Date': None} if file_format == 'svg' else None
                try:
                    with written_whole(folder / name) as partial:
                        figure.savefig(partial, format=file_format, metadata=metadata, bbox_inches='tight',
                                       pad_inches=.1)
                finally:
                    plt.close(figure)
                written.append((name, drawing.caption))
        return written

    def drawings(self) -> List[Drawing]:
        """The experiment's figures, or the general ones."""
        own: Dict[str, Callable[[], List[Drawing]]] = {
            'speed': self._speed, 'single_run': self._single_run, 'kidnapped': self._kidnapped,
            'motion_grid': self._motion_grid, 'hybrid_particles': self._hybrid_particles,
            'thresholds': self._thresholds, **dict.fromkeys(HYBRID, self._hybrid)}
        return own.get(self._results.experiment, self._general)()

    def _bars(self, name: str, caption: str, metric: str, label: str, decimals: int, spread: Optional[str] = None,
              scale: float = 1) -> List[Drawing]:
        if max(len(self._results.of(group)) for group in self._results.groups()) > MOST_BARS:
            return []
        return [Drawing(name, caption, lambda title: bars_figure(self._results, self._papers, self._palette, title,
                                                                 metric, label, decimals, spread, scale))]

    def _error_bars(self) -> List[Drawing]:
        return self._bars('error', 'Mean error and standard deviation', 'mean_err_m', 'mean error [m]', 2,
                          'std_err_m')

    def _comparison_bars(self) -> List[Drawing]:
        return self._bars('comparisons', 'Comparisons per image', 'comparisons_per_image', 'comparisons per image', 1)

    def _steps(self) -> List[Drawing]:
        return [Drawing('error_over_images', 'Mean error over the images of all runs',
                        lambda title: steps_figure(self._results, self._palette, title))]

    def _general(self) -> List[Drawing]:
        return self._error_bars() + self._comparison_bars() + (
            self._steps() if len(self._results.methods()) <= MOST_BARS else []) + [
                Drawing('reliability', 'How often estimates are right by the probability around them, all pairs',
                        lambda title: reliability_figure(self._results, self._palette, title))]

    def _speed(self) -> List[Drawing]:
        return [Drawing('speed', 'Mean error at different simulated speeds',
                        lambda title: speed_figure(self._results, self._papers, self._palette, title)),
                *self._comparison_bars()]

    def _single_run(self) -> List[Drawing]:
        drawings = []
        for pair, traces in self._results.traces.items():
            suffix = '' if len(self._results.traces) == 1 else '_' + '_'.join(map(plain, pair))
            where = f'{pair[0]} → {pair[1]}'
            drawings.append(Drawing(f'run{suffix}', f'Single runs, {where}',
                                    lambda title, traces=traces: runs_figure(traces, self._palette, title)))
            for name, part in diversity_parts(traces).items():
                drawings.append(Drawing(name + suffix, f'Diversity in single runs, {where}',
                                        lambda title, part=part: diversity_figure(part, self._palette, title)))
        return drawings + self._error_bars() + self._comparison_bars()

    def _kidnapped(self) -> List[Drawing]:
        return [Drawing('kidnapped', 'Mean error over the images of all kidnapped runs',
                        lambda title: kidnapped_figure(self._results, self._palette, title)),
                *self._error_bars(), *self._comparison_bars()]

    def _motion_grid(self) -> List[Drawing]:
        groups = self._results.groups()
        return [Drawing('motion_grid' + ('' if len(groups) == 1 else '_' + '_'.join(map(plain, group))),
                        'Mean error over the motion model\'s settings',
                        lambda title, group=group: motion_figure(self._results, self._papers, group, title))
                for group in groups] + self._error_bars()

    def _hybrid(self) -> List[Drawing]:
        return (self._error_bars() + self._steps()
                + self._bars('sift_share', 'Images for which SIFT was used', 'sift_share', 'SIFT steps [%]', 1,
                             scale=100)
                + [Drawing('time', 'Time per image',
                           lambda title: cost_figure(self._results, self._papers, self._palette, title))])

    def _hybrid_particles(self) -> List[Drawing]:
        return [Drawing('error_over_images', 'Mean error over the images with different numbers of particles',
                        lambda title: counts_figure(self._results, self._palette, title)), *self._error_bars()]

    def _thresholds(self) -> List[Drawing]:
        return [Drawing('thresholds', 'Mean error and share of SIFT steps over the thresholds',
                        lambda title: thresholds_figure(self._results, title))]


def plain(name: str) -> str:
    """A name that is safe in a file name and in a link."""
    return ''.join(letter if letter.isalnum() and letter.isascii() else '_' for letter in name)
