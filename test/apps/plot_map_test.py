"""plot_map.py on made-up sessions: what it draws, in which formats, and what it refuses."""
import json
import os
import subprocess
import sys
import tempfile
import unittest
import warnings
from pathlib import Path

SCRIPT = Path(sys.argv[1])
sys.path.insert(0, str(SCRIPT.parent))
import matplotlib.image  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import plot_map  # noqa: E402

VERDICTS = ('kept', 'no fix', 'out of order', 'spike', 'multipath')


def session(name: str = 'monday', east: float = 0.0, **fixes) -> dict:
    """A session of 20 m due north with five training images; fixes by verdict, 'no_fix' for 'no fix'."""
    path = [[east, float(north)] for north in range(21)]
    given = {verdict: fixes.get(verdict.replace(' ', '_'), []) for verdict in VERDICTS}
    return {'name': name, 'paths_m': [path], 'images_m': path[::5], 'landmarks_m': [], 'length_m': 20.0, 'gaps_closed': 1,
            'fixes': {verdict: {'count': len(rows), 'positions_m': rows} for verdict, rows in given.items()}}


def run(*arguments, **environment) -> subprocess.CompletedProcess:
    """The script to its end, without a display."""
    inherited = {name: value for name, value in os.environ.items() if name not in ('DISPLAY', 'WAYLAND_DISPLAY')}
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True,
                          timeout=100, check=False, env={**inherited, **environment})


class PlotMapTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(plt.close, 'all')
        self.folder = Path(folder.name)
        self.data, self.picture = self.folder / 'data.json', self.folder / 'plot.png'

    def write(self, *sessions: dict) -> None:
        self.data.write_text(json.dumps({'sessions': sessions}), encoding='utf-8')

    def draw(self, *sessions: dict) -> list:
        self.write(*sessions)
        with plt.rc_context(plot_map.STYLE):
            figure = plot_map.draw(plot_map.read_sessions(self.data))
            with warnings.catch_warnings():
                warnings.filterwarnings('ignore', message='Glyph')  # that the font lacks
                figure.canvas.draw()
        return figure.axes

    @staticmethod
    def marks(panel, name: str) -> list:
        """The marks of one kind, east and north."""
        line, = [line for line in panel.lines if line.get_gid() == name]
        return line.get_xydata().tolist()

    @staticmethod
    def paths(panel, colour: str) -> list:
        return [line.get_xydata().tolist() for line in panel.lines
                if line.get_color() == colour and line.get_linestyle() == '-']

    @staticmethod
    def legend(panel) -> list:
        return [text.get_text() for text in panel.get_legend().get_texts()]

    def assert_refused(self, result: subprocess.CompletedProcess, code: int, *words: str) -> None:
        """One line with these words; nothing but the data is in the folder."""
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual([path.name for path in self.folder.iterdir() if path != self.data], [])

    def test_each_verdict_has_marks_of_its_own(self):
        given = {'kept': [[0, 1], [0, 2]], 'no_fix': [[0, 3]], 'out_of_order': [[1, 4]], 'spike': [[2, 5]],
                 'multipath': [[3, 6], [3, 7], [3, 8]]}
        panel, = self.draw(session(**given))
        looks = set()
        for verdict, positions in given.items():
            self.assertEqual(self.marks(panel, verdict + '_0'), positions)
            line, = [line for line in panel.lines if line.get_gid() == verdict + '_0']
            looks.add((line.get_marker(), line.get_color(), line.get_markerfacecolor()))
        self.assertEqual(len(looks), len(given))
        self.assertEqual(self.marks(panel, 'images_0'), [[0, 0], [0, 5], [0, 10], [0, 15], [0, 20]])

    def test_the_legend_counts(self):
        one = session(kept=[[0, 1]], no_fix=[[0, 3]])
        one['fixes']['no fix']['count'] = 7  # six of them before the path begins
        panel, = self.draw(one)
        self.assertEqual(self.legend(panel),
                         ['8 fixes', '1 kept', '0 multipath', '7 no fix, drawn on the path', '0 out of order',
                          '0 spikes (single outliers)', 'cleaned path, 20 m', '5 training images', '1 gaps closed',
                          'Marks on the border lie outside.'])
        colours = [text.get_color() for text in panel.get_legend().get_texts()]
        self.assertNotEqual(colours[1], colours[2])
        self.assertEqual(colours[2], colours[4])

    def test_landmarks_are_dots_and_those_far_off_are_left_out(self):
        one = dict(session(), landmarks_m=[[1, 1], [-1, 19], [500, 3]], images_m=[[.3, 0], [.3, 10]])
        panel, = self.draw(one)
        self.assertEqual(self.marks(panel, 'landmarks_0'), [[1, 1], [-1, 19]])
        self.assertEqual(self.marks(panel, 'images_0'), [[.3, 0], [.3, 10]])
        self.assertIn('landmarks', self.legend(panel))
        self.assertIn('2 training images, adjusted', self.legend(panel))
        self.assertEqual(self.paths(panel, plot_map.SESSION_COLOURS[0]), [], 'the cleaned path is dashed')

    def test_a_path_that_was_left_open_is_not_closed(self):
        one = session()
        one['paths_m'] = [one['paths_m'][0][:8], one['paths_m'][0][15:]]
        panel, = self.draw(one)
        self.assertEqual(self.paths(panel, plot_map.SESSION_COLOURS[0]), one['paths_m'])

    def test_several_sessions_have_a_panel_with_all_paths(self):
        panels = self.draw(session('monday'), session('tuesday', 2.0))
        self.assertEqual([panel.get_title('left') for panel in panels],
                         ['monday', 'tuesday', 'all sessions, cleaned paths'])
        self.assertEqual(self.legend(panels[2]), ['2 sessions', 'monday', 'tuesday', 'A dot is where a path begins.'])
        for number, east in enumerate((0.0, 2.0)):
            path, = self.paths(panels[2], plot_map.SESSION_COLOURS[number])
            self.assertEqual((path[0], path[-1]), ([east, 0.0], [east, 20.0]))
            self.assertEqual(self.marks(panels[2], f'start_{number}'), [[east, 0.0]])
        self.assertEqual(panels[0].get_xlim(), panels[1].get_xlim())

    def test_metres_have_one_scale_on_both_axes_and_north_is_up(self):
        for one in (session(), session(multipath=[[60, 3]])):
            panel, = self.draw(one)
            origin, east, north = panel.transData.transform([(0, 0), (1, 0), (0, 1)])
            self.assertAlmostEqual(east[0] - origin[0], north[1] - origin[1], delta=.02)
            self.assertGreater(north[1], origin[1])
            self.assertEqual((panel.get_xlabel(), panel.get_ylabel()), ('east of the datum [m]', 'north [m]'))
            texts = [text.get_text() for text in panel.texts]
            self.assertEqual(texts.count('N'), 1)
            bar, = [line for line in panel.lines if line.get_color() == 'black' and line.get_linestyle() == '-']
            self.assertIn(f'{bar.get_xdata().max() - bar.get_xdata().min():g} m', texts)

    def test_panels_and_legends_lie_within_the_page_and_apart(self):
        panels = self.draw(session('n' * 200), session('0' * 200, 30.0))
        figure = panels[0].figure
        boxes = [panel.get_tightbbox(figure.canvas.get_renderer()) for panel in panels]
        for box in boxes:
            self.assertGreaterEqual(box.y0, 0)
            self.assertGreaterEqual(box.x0, 0)
            self.assertLessEqual(box.y1, figure.bbox.y1)
            self.assertLessEqual(box.x1, figure.bbox.x1)
        for above, below in zip(boxes, boxes[1:]):
            self.assertGreater(above.y0, below.y1)

    def test_what_lies_outside_is_put_on_the_border(self):
        panel, = self.draw(session(kept=[[0, 1]], spike=[[9000, 3], [0, -9000]]))
        self.assertEqual(self.marks(panel, 'spike_0'), [[panel.get_xlim()[1], 3], [0, panel.get_ylim()[0]]])

    def test_multipath_has_room(self):
        panel, = self.draw(session(multipath=[[4, 10]]))
        self.assertEqual(self.marks(panel, 'multipath_0'), [[4, 10]])
        self.assertGreater(panel.get_xlim()[1], 4)

    def test_sessions_far_apart_are_shown_alone(self):
        panels = self.draw(session('here'), session('there', 5000.0))
        for panel, east in zip(panels, (0.0, 5000.0)):
            self.assertLess(panel.get_xlim()[1] - panel.get_xlim()[0], 100)
            self.assertAlmostEqual(sum(panel.get_xlim()) / 2, east, delta=1)
        self.assertGreater(panels[2].get_xlim()[1] - panels[2].get_xlim()[0], 5000)

    def test_names_are_shown_as_they_are(self):
        for name, shown in (('a<b>&"c\'', 'a<b>&"c\''), ('T\u00fc\u20ac\U0001f697', 'T\u00fc\u20ac\U0001f697'),
                            ('a\nb\x1b\x7f\ufffe', 'a?b???'), ('$x_1$ $', '\\$x_1\\$ \\$')):
            with self.subTest(name=name):
                panel, = self.draw(session(name))
                self.assertEqual(panel.get_title('left'), shown)

    def test_long_names_keep_their_end(self):
        panels = self.draw(session('x' * 60 + '\u20ac' * 60), session('y'))
        self.assertEqual(panels[0].get_title('left'), '...' + 47 * '\u20ac')
        self.assertEqual(self.legend(panels[2])[1], '...' + 23 * '\u20ac')

    def test_the_ending_decides_the_format(self):
        self.write(session(kept=[[0, 1]]))
        for ending, begin in (('.png', b'\x89PNG'), ('.svg', b'<?xml'), ('.pdf', b'%PDF'), ('.PNG', b'\x89PNG')):
            with self.subTest(ending=ending):
                picture = self.folder / f'plot{ending}'
                result = run(self.data, picture)
                self.assertEqual((result.returncode, result.stdout, result.stderr), (0, '', ''))
                first = picture.read_bytes()
                self.assertTrue(first.startswith(begin))
                self.assertEqual(run(self.data, picture).returncode, 0)
                self.assertEqual(picture.read_bytes(), first)
        self.assertEqual([path.name for path in self.folder.iterdir() if 'partial' in path.name], [])

    def test_a_link_stays_a_link(self):
        self.write(session())
        self.picture.symlink_to(self.folder / 'target.png')
        self.assertEqual(run(self.data, self.picture).returncode, 0)
        self.assertTrue(self.picture.is_symlink())
        self.assertEqual(matplotlib.image.imread(str(self.folder / 'target.png')).ndim, 3)

    def test_a_page_of_any_height_is_a_picture(self):
        with plt.rc_context(plot_map.STYLE):
            plot_map.save(plt.figure(figsize=(.1, 2000)), self.picture)
        self.assertLessEqual(matplotlib.image.imread(str(self.picture)).shape[0], 2 ** 16)

    def test_bad_usage_is_code_2(self):
        self.write(session())
        for arguments, word in (((self.data, self.folder / 'plot.txt'), '.png, .svg or .pdf'),
                                ((self.data, self.folder / 'png'), '.png, .svg or .pdf'), ((self.data,), 'PICTURE'),
                                ((self.data, self.picture, '--nonsense'), '--nonsense')):
            with self.subTest(arguments=arguments):
                self.assert_refused(run(*arguments), 2, 'plot_map: ', word)

    def test_data_that_cannot_be_used_are_refused(self):
        self.assert_refused(run(self.data, self.picture), 1, 'data.json: cannot be read')
        cut = session()
        del cut['fixes']['spike']
        for content in ('', '{', '[]', '{"sessions": [{}]}', json.dumps({'sessions': [cut]}),
                        json.dumps({'sessions': [dict(session(), images_m=[[1, 2, 3]])]})):
            with self.subTest(content=content):
                self.data.write_text(content, encoding='utf-8')
                self.assert_refused(run(self.data, self.picture), 1, 'data.json: is not what map_builder writes')

    def test_a_picture_that_cannot_be_written_leaves_nothing(self):
        self.write(session())
        self.picture.mkdir()
        result = run(self.data, self.picture)
        self.assertEqual((result.returncode, len(result.stderr.splitlines())), (1, 1), result.stderr)
        self.assertIn('plot.png: cannot be written', result.stderr)
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ['data.json', 'plot.png'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
