#!/usr/bin/python3
"""Plots what a localizer says about itself: state, source, inliers, sigma, similarity, comparisons, cloud and latency.

Of a running localizer in a window that renews itself, or in a picture (--output FILE.png) that is written every few
seconds, for machines without a display; of a recorded status topic with --bag. For machines without rqt.
"""
import argparse
import collections
import math
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Deque, Dict, Iterable, List, Optional

import matplotlib
import matplotlib.patches
import numpy as np

COLOURS = {'NO_MAP': '#505050', 'INITIALIZING': '#7f7f7f', 'TRACKING': '#2ca02c', 'UNCERTAIN': '#ff7f0e',
           'RECOVERING': '#d62728', 'OFF_MAP': '#9467bd'}
SOURCES = {'METRIC': '#2166ac', 'PLACE': '#92c5de', 'NONE': '#dddddd'}
FIGURES = ('inliers', 'sigma_position', 'best_similarity', 'probability', 'min_probability', 'off_map', 'comparisons',
           'extract_ms', 'match_ms', 'update_ms', 'latency_ms')
BLUE, ORANGE, GREEN, GREY = '#1f77b4', '#e08214', '#4d9221', '#404040'


class Failure(Exception):
    """What a user can mend; the message is the whole answer."""


class History:
    """The figures of the last images. Thread-safe."""

    def __init__(self, seconds: float = math.inf):
        self._seconds = seconds
        self._rows: Deque[Dict[str, float]] = collections.deque()
        self._states: Deque[str] = collections.deque()
        self._sources: Deque[str] = collections.deque()
        self._lock = threading.Lock()

    def add(self, status) -> None:
        """One more status; begins anew when time goes back, as it does when a bag is played again, and when simulated
        time begins, which is 0 until then."""
        answers_an_image = status.best_image >= 0
        # A bag of an older version has no inliers and no sigma.
        row = {name: float(getattr(status, name, math.nan)) if answers_an_image else math.nan for name in FIGURES}
        row['stamp'] = status.header.stamp.to_sec()
        with self._lock:
            before = self._rows[-1]['stamp'] if self._rows else row['stamp']
            if row['stamp'] < before or before == 0 < row['stamp']:
                self._rows.clear()
                self._states.clear()
                self._sources.clear()
            self._rows.append(row)
            self._states.append(status.state_name)
            self._sources.append(getattr(status, 'source_name', ''))
            while row['stamp'] - self._rows[0]['stamp'] > self._seconds:
                self._rows.popleft()
                self._states.popleft()
                self._sources.popleft()

    def columns(self) -> Dict[str, np.ndarray]:
        """The figures by name, and `seconds` since the first image shown; empty without any."""
        with self._lock:
            rows = list(self._rows)
        if not rows:
            return {}
        columns = {name: np.array([row[name] for row in rows]) for name in (*FIGURES, 'stamp')}
        columns['seconds'] = columns['stamp'] - columns['stamp'][0]
        columns['latency_ms'][columns['latency_ms'] == -1] = math.nan  # the image has no stamp
        columns['sigma_position'][~(columns['sigma_position'] > 0)] = math.nan  # the axis is logarithmic
        return columns

    def sources(self) -> List[str]:
        """What the pose of every image rests on; empty words in a bag of an older version."""
        with self._lock:
            return list(self._sources)

    def states(self) -> List[str]:
        with self._lock:
            return list(self._states)


class Plot:
    """The figure: bands of states and sources, and a panel for each question."""

    def __init__(self, title: str):
        import matplotlib.pyplot as plt  # after the backend has been chosen
        plt.rcParams.update({'font.size': 9, 'axes.spines.top': False, 'axes.spines.right': False,
                             'axes.edgecolor': '#909090', 'axes.titlelocation': 'left', 'axes.titlesize': 9})
        self.figure, axes = plt.subplots(8, 1, sharex=True, figsize=(10, 9.5),
                                         gridspec_kw={'height_ratios': [.35, .2, 1, 1, 1, 1, 1, 1], 'hspace': .4,
                                                      'left': .055, 'right': .985, 'top': .94, 'bottom': .05})
        self._state_band, self._source_band, self._panels = axes[0], axes[1], axes[2:]
        self._title = title
        if hasattr(self.figure.canvas.manager, 'set_window_title'):
            self.figure.canvas.manager.set_window_title(title)

    def draw(self, history: History) -> None:
        columns, states, sources = history.columns(), history.states(), history.sources()
        count = min(len(columns['seconds']), len(states), len(sources)) if columns else 0
        columns = {name: column[:count] for name, column in columns.items()}
        states, sources = states[:count], sources[:count]
        for axes in (self._state_band, self._source_band, *self._panels):
            axes.clear()
        if not states:
            self.figure.suptitle(f'{self._title}: no status yet', x=.01, y=.985, ha='left', fontsize=12)
            return
        self.figure.suptitle(f'{self._title}: {states[-1]}', x=.01, y=.985, ha='left', fontsize=12, fontweight='bold',
                             color=COLOURS.get(states[-1], GREY))
        edges = self._edges(columns['seconds'])
        self._draw_band(self._state_band, edges, states, COLOURS)
        self._draw_band(self._source_band, edges, sources, SOURCES)
        self._draw_panels(columns)
        for axes in self._panels:
            self._shade(axes, edges, states, COLOURS, .10)
            axes.grid(axis='y', color='#d8d8d8', linewidth=.6, zorder=0)
            axes.set_axisbelow(True)
        self._panels[-1].set_xlabel('time [s]')
        self._panels[-1].set_xlim(edges[0], edges[-1])

    @staticmethod
    def _edges(seconds: np.ndarray) -> np.ndarray:
        """Where the stretch of each image begins, and where the last one ends."""
        step = float(np.median(np.diff(seconds))) if seconds.size > 1 else 1.0
        return np.append(seconds, seconds[-1] + max(step, 1e-3))

    @staticmethod
    def _shade(axes, edges: np.ndarray, words: List[str], colours: Dict[str, str], alpha: float) -> None:
        """One rectangle for each stretch of the same word."""
        begin = 0
        for i in range(1, len(words) + 1):
            if i == len(words) or words[i] != words[begin]:
                axes.axvspan(edges[begin], edges[i], color=colours.get(words[begin], GREY), alpha=alpha, linewidth=0,
                             zorder=0)
                begin = i

    def _draw_band(self, axes, edges: np.ndarray, words: List[str], colours: Dict[str, str]) -> None:
        self._shade(axes, edges, words, colours, 1.0)
        axes.set(yticks=[], ylim=(0, 1))
        axes.spines['left'].set_visible(False)
        present = [word for word in colours if word in words]
        handles = [matplotlib.patches.Patch(color=colours[word],
                                            label=f'{word} {100 * words.count(word) / len(words):.0f} %')
                   for word in present]
        if handles:
            axes.legend(handles=handles, loc='lower right', bbox_to_anchor=(1, 1), ncol=len(handles), frameon=False,
                        borderaxespad=.1, handlelength=1, columnspacing=1.2)

    def _draw_panels(self, columns: Dict[str, np.ndarray]) -> None:
        seconds = columns['seconds']
        probability, inliers, certainty, similarity, comparisons, times = self._panels

        def line(axes, name: str, colour: str, label: Optional[str] = None) -> None:
            marker = '.' if seconds.size < 2 else None
            axes.plot(seconds, columns[name], color=colour, linewidth=1.2, label=label, marker=marker)

        line(probability, 'probability', BLUE, 'around the pose')
        line(probability, 'off_map', ORANGE, 'off the map')
        line(probability, 'min_probability', GREY, 'least that confirms')
        probability.set_title('probability')
        probability.set_ylim(-.02, 1.02)
        line(inliers, 'inliers', BLUE)
        inliers.set_title('landmarks that agree with the pose: 0 where it is not metric')
        line(certainty, 'sigma_position', BLUE)
        certainty.set_title('sigma of the position [m]: METRIC against the map, PLACE in all')
        if np.isfinite(columns['sigma_position']).any():
            certainty.set_yscale('log')
        line(similarity, 'best_similarity', BLUE)
        similarity.set_title('similarity of the best training image')
        line(comparisons, 'comparisons', BLUE)
        comparisons.set_title('training images compared')
        stages = [columns[name] for name in ('extract_ms', 'match_ms', 'update_ms')]
        times.stackplot(seconds, *stages, labels=('extract', 'match', 'update'), colors=(BLUE, ORANGE, GREEN), alpha=.7)
        line(times, 'latency_ms', GREY, 'latency')
        times.set_title('time per image [ms]')
        for axes in (inliers, similarity, comparisons, times):
            axes.set_ylim(bottom=0)
        # Single outliers must not press the rest flat.
        longest = np.fmax(columns['latency_ms'], sum(stages))
        top = min(self._quantile(longest, 1.0, 1.0), 3 * self._quantile(longest, .95, 1.0))
        times.set_ylim(top=1.05 * max(1.0, top))
        for axes in (probability, times):
            axes.legend(loc='lower right', bbox_to_anchor=(1, 1), ncol=4, frameon=False, borderaxespad=.1,
                        handlelength=1.2, columnspacing=1.2)

    @staticmethod
    def _quantile(figures: np.ndarray, share: float, otherwise: float) -> float:
        """Of those that are numbers."""
        finite = figures[np.isfinite(figures)]
        return float(np.quantile(finite, share)) if finite.size else otherwise

    def save(self, path: Path) -> None:
        """Whole or not at all: somebody may be looking at it."""
        partial = path.with_name(f'.{path.name}.{os.getpid()}.partial')
        try:
            self.figure.savefig(partial, dpi=110, format=path.suffix[1:].lower())
            os.replace(partial, path)
        except OSError as error:
            raise Failure(f'{path}: cannot be written: {error.strerror}') from error
        finally:
            partial.unlink(missing_ok=True)


def statuses_of(bag: Path, topic: str) -> Iterable:
    """The messages of a topic of a bag; the bag itself says what they look like."""
    import rosbag
    try:
        with rosbag.Bag(str(bag)) as file:
            for _, message, _ in file.read_messages([topic]):
                if not hasattr(message, 'best_similarity'):
                    raise Failure(f'{bag}: {topic} is not a LocalizationStatus')
                yield message
    except (OSError, rosbag.ROSBagException) as error:
        raise Failure(f'{bag}: cannot be read: {error}') from error


def plot_bag(args: argparse.Namespace) -> None:
    history, topic = History(), f'{args.localizer}/status'
    for status in statuses_of(args.bag, topic):
        history.add(status)
    if not history.states():
        raise Failure(f'{args.bag}: holds no message of {topic}')
    plot = Plot(f'{args.bag.name} {args.localizer}')
    plot.draw(history)
    if args.output:
        plot.save(args.output)
    else:
        import matplotlib.pyplot as plt
        plt.show()


def listen(localizer: str, history: History, stop: threading.Event) -> None:
    """Fills the history from now on; sets `stop` when the node is shut down from elsewhere."""
    import rospy
    try:
        from visual_localization.msg import LocalizationStatus
    except ImportError as error:
        raise Failure('source the devel/setup.bash of the workspace first: no messages of visual_localization') \
            from error
    rospy.init_node('plot_status', anonymous=True, disable_signals=True)
    rospy.on_shutdown(stop.set)
    rospy.Subscriber(f'{localizer}/status', LocalizationStatus, history.add, queue_size=1000)


def plot_live(args: argparse.Namespace) -> None:
    """Until the node is told to end or the window is closed. By the wall's clock: a simulated one may stand still."""
    import matplotlib.pyplot as plt
    history, plot, stop = History(args.seconds), Plot(args.localizer), threading.Event()
    if args.output:
        plot.save(args.output)  # rather fail now than in a while
    # An exception out of a signal's handler would be lost in the window's event loop.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    listen(args.localizer, history, stop)
    if not args.output:
        plt.show(block=False)
    while not stop.is_set() and (args.output or plt.fignum_exists(plot.figure.number)):
        plot.draw(history)
        if args.output:
            plot.save(args.output)
            stop.wait(args.every)
        else:
            show_for(args.every, plot, stop)
    if args.output:
        plot.draw(history)
        plot.save(args.output)


def show_for(seconds: float, plot: Plot, stop: threading.Event) -> None:
    """Lets the window live for a while, in short turns so that it ends soon when it is told to."""
    plot.figure.canvas.draw_idle()
    end = time.monotonic() + seconds
    while time.monotonic() < end and not stop.is_set():
        plot.figure.canvas.start_event_loop(min(.2, seconds))


def choose_backend(output: Optional[Path]) -> None:
    """A picture needs no display; a window needs one, and a toolkit."""
    if output:
        matplotlib.use('Agg')
    elif not (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
        raise Failure('there is no display: give --output FILE.png')
    elif matplotlib.get_backend().lower() == 'agg':
        raise Failure('matplotlib opens no window here: install python3-tk, or give --output FILE.png')


def positive(text: str) -> float:
    number = float(text)
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f'{text} is not above 0')
    return number


def picture(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in ('.png', '.svg', '.pdf'):
        raise argparse.ArgumentTypeError(f'{text} does not end in .png, .svg or .pdf')
    return path


def parse_arguments() -> argparse.Namespace:
    """Command line; what roslaunch appends to it is left out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--localizer', default='/localizer', help='name of the node (default: %(default)s)')
    parser.add_argument('--output', type=picture, help='write this PNG, SVG or PDF instead of opening a window')
    parser.add_argument('--every', type=positive, default=1.0, metavar='SECONDS',
                        help='renew window or picture so often (default: %(default)s)')
    parser.add_argument('--seconds', type=positive, default=180.0, help='how much to show (default: %(default)s)')
    parser.add_argument('--bag', type=Path, help='plot the status recorded in this bag, all of it')
    return parser.parse_args([word for word in sys.argv[1:] if ':=' not in word])


def main() -> int:
    """Plots a bag or a running localizer."""
    args = parse_arguments()
    try:
        choose_backend(args.output)
        (plot_bag if args.bag else plot_live)(args)
    except Failure as failure:
        print(f'plot_status: {failure}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == '__main__':
    sys.exit(main())
