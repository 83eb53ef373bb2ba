"""plot_status.py on recorded statuses: what it remembers, what it draws, what it refuses. test/ros has the live one."""
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT, MESSAGES = (Path(argument) for argument in sys.argv[1:3])
sys.path.insert(0, str(SCRIPT.parent))
import genpy.dynamic  # noqa: E402
import matplotlib.image  # noqa: E402
import rosbag  # noqa: E402
import rospy  # noqa: E402
from std_msgs.msg import Header, String  # noqa: E402
import plot_status  # noqa: E402

TYPE = 'visual_localization/LocalizationStatus'
TOPIC = '/localizer/status'
# From its definition, so that no built workspace is needed.
Status = genpy.dynamic.generate_dynamic(TYPE, '\n'.join((
    (MESSAGES / 'LocalizationStatus.msg').read_text(encoding='utf-8'), 80 * '=', 'MSG: std_msgs/Header',
    Header._full_text, 80 * '=', 'MSG: visual_localization/Reason',
    (MESSAGES / 'Reason.msg').read_text(encoding='utf-8'))))[TYPE]


def status_at(seconds: float, state: str = 'TRACKING', **figures: float):
    """A plausible status."""
    status = Status(state=getattr(Status, state), state_name=state, best_image=7, best_similarity=.2, probability=.998,
                    min_probability=.97, off_map=.001, source_name='METRIC', inliers=50, sigma_position=.04,
                    comparisons=20, extract_ms=9.0, match_ms=4.0, update_ms=.3, latency_ms=15.0)
    status.header.stamp = rospy.Time.from_sec(seconds)
    for name, figure in figures.items():
        setattr(status, name, figure)
    return status


def run(*arguments, **environment) -> subprocess.CompletedProcess:
    inherited = {name: value for name, value in os.environ.items()
                 if name not in ('DISPLAY', 'WAYLAND_DISPLAY', 'ROS_MASTER_URI')}
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True,
                          timeout=100, check=False, env={**inherited, **environment})


class HistoryTest(unittest.TestCase):
    """What is remembered of the statuses that came."""

    def test_seconds_count_from_the_first_image_shown(self):
        history = plot_status.History()
        for second in (100.0, 101.5, 103.0):
            history.add(status_at(second))
        self.assertEqual(list(history.columns()['seconds']), [0.0, 1.5, 3.0])
        self.assertEqual(history.states(), 3 * ['TRACKING'])

    def test_old_ones_are_forgotten(self):
        history = plot_status.History(seconds=10)
        for second in range(100):
            history.add(status_at(second))
        self.assertEqual(len(history.states()), 11)

    def test_it_begins_anew_when_time_goes_back(self):
        history = plot_status.History()
        for second in (100.0, 101.0, 50.0):
            history.add(status_at(second, 'RECOVERING' if second == 50.0 else 'TRACKING'))
        self.assertEqual(history.states(), ['RECOVERING'])

    def test_it_begins_when_simulated_time_does(self):
        history = plot_status.History()
        for second in (0.0, 0.0, 1.2e9, 1.2e9 + 1):
            history.add(status_at(second, 'INITIALIZING' if second == 0 else 'TRACKING'))
        self.assertEqual(history.states(), 2 * ['TRACKING'])
        self.assertEqual(list(history.columns()['seconds']), [0.0, 1.0])

    def test_an_unknown_latency_is_not_drawn(self):
        history = plot_status.History()
        history.add(status_at(1.0, latency_ms=-1.0))
        self.assertTrue(math.isnan(history.columns()['latency_ms'][0]))

    def test_a_status_that_answers_no_image_has_a_state_but_no_figures(self):
        history = plot_status.History()
        history.add(status_at(1.0, 'UNCERTAIN', best_image=-1))
        self.assertTrue(math.isnan(history.columns()['comparisons'][0]))
        self.assertEqual(history.states(), ['UNCERTAIN'])

    def test_sources_and_sigma_are_remembered(self):
        history = plot_status.History(seconds=10)
        history.add(status_at(0.0))
        history.add(status_at(15.0, source_name='PLACE', sigma_position=2.0))
        history.add(status_at(16.0, source_name='NONE', sigma_position=0.0))
        self.assertEqual(history.sources(), ['PLACE', 'NONE'])
        sigma = history.columns()['sigma_position']
        self.assertEqual(sigma[0], 2.0)
        self.assertTrue(math.isnan(sigma[1]), 'the axis is logarithmic')

    def test_nothing_came_yet(self):
        self.assertEqual(plot_status.History().columns(), {})


class PlotTest(unittest.TestCase):
    """The script as a user meets it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.bag, self.output = self.folder / 'drive.bag', self.folder / 'status.png'

    def record(self, states: list, topic: str = TOPIC) -> None:
        """A bag with a status a second."""
        with rosbag.Bag(str(self.bag), 'w') as bag:
            for second, state in enumerate(states):
                bag.write(topic, status_at(1000.0 + second, state), rospy.Time(1000 + second))

    def plot(self, *arguments, **environment) -> subprocess.CompletedProcess:
        return run('--bag', self.bag, '--output', self.output, *arguments, **environment)

    def assert_refused(self, result: subprocess.CompletedProcess, code: int, *words: str) -> None:
        """The last line says why; there is no output."""
        self.assertEqual(result.returncode, code, result.stderr)
        for word in words:
            self.assertIn(word, result.stderr.splitlines()[-1])
        self.assertEqual([path.name for path in self.folder.iterdir() if path.suffix != '.bag'], [])

    def share_of(self, word: str) -> float:
        """Of the picture's pixels, how many have the full colour of a state or a source."""
        colour = {**plot_status.COLOURS, **plot_status.SOURCES}[word]
        wanted = [int(colour[i:i + 2], 16) / 255 for i in (1, 3, 5)]
        return (abs(matplotlib.image.imread(str(self.output))[:, :, :3] - wanted).max(axis=2) < .01).mean()

    def test_states_are_drawn_in_proportion(self):
        self.record(30 * ['INITIALIZING'] + 60 * ['TRACKING'] + 30 * ['RECOVERING'])
        result = self.plot()
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        self.assertAlmostEqual(self.share_of('INITIALIZING') / self.share_of('RECOVERING'), 1.0, delta=.15)
        self.assertAlmostEqual(self.share_of('TRACKING') / self.share_of('RECOVERING'), 2.0, delta=.3)
        self.assertEqual(self.share_of('OFF_MAP'), 0.0)
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ['drive.bag', 'status.png'])

    def test_sources_are_drawn(self):
        with rosbag.Bag(str(self.bag), 'w') as bag:
            for second in range(20):
                source = 'METRIC' if second < 15 else 'PLACE'
                bag.write(TOPIC, status_at(1000.0 + second, source_name=source), rospy.Time(1000 + second))
        result = self.plot()
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        self.assertGreater(self.share_of('METRIC'), 2 * self.share_of('PLACE'))
        self.assertGreater(self.share_of('PLACE'), 0.0)

    def test_one_image_is_enough(self):
        self.record(['OFF_MAP'])
        self.assertEqual(self.plot().returncode, 0)
        self.assertGreater(self.share_of('OFF_MAP'), 0.0)

    def test_a_silent_camera_is_drawn(self):
        with rosbag.Bag(str(self.bag), 'w') as bag:
            bag.write(TOPIC, status_at(1000.0, 'UNCERTAIN', best_image=-1), rospy.Time(1000))
        self.assertEqual(self.plot().returncode, 0)
        self.assertGreater(self.share_of('UNCERTAIN'), 0.0)

    def test_other_names_and_formats(self):
        self.record(['TRACKING', 'UNCERTAIN'], '/front/status')
        self.output = self.folder / 'status.svg'
        self.assertEqual(self.plot('--localizer', '/front').returncode, 0)
        self.assertIn('<svg', self.output.read_text(encoding='utf-8'))

    def test_a_bag_without_statuses_is_refused(self):
        self.record(['TRACKING'])
        self.assert_refused(self.plot('--localizer', '/other'), 1, 'drive.bag', '/other/status')
        with rosbag.Bag(str(self.bag), 'w') as bag:
            bag.write(TOPIC, String('words'), rospy.Time(1))
        self.assert_refused(self.plot(), 1, 'drive.bag', TOPIC, 'LocalizationStatus')

    def test_a_bag_that_cannot_be_read_is_refused(self):
        self.assert_refused(self.plot(), 1, 'drive.bag')
        self.bag.write_bytes(b'no bag at all')
        self.assert_refused(self.plot(), 1, 'drive.bag')

    def test_a_folder_that_does_not_exist_is_refused(self):
        self.record(['TRACKING'])
        self.output = self.folder / 'absent' / 'status.png'
        self.assert_refused(self.plot(), 1, 'absent', 'cannot be written')

    def test_without_a_display_a_picture_must_be_asked_for(self):
        self.record(['TRACKING'])
        self.assert_refused(run('--bag', self.bag), 1, '--output')

    def test_bad_usage_is_code_2(self):
        for arguments, word in ((('--output', 'status.txt'), '.png'), (('--every', '0'), 'above 0'),
                                (('--every', 'often'), 'often'), (('--seconds', 'nan'), 'above 0'),
                                (('--nonsense',), '--nonsense')):
            with self.subTest(arguments=arguments):
                self.assert_refused(run(*arguments), 2, word)

    def test_what_roslaunch_appends_is_left_out(self):
        self.record(['TRACKING'])
        self.assertEqual(self.plot('__name:=plot', '__log:=/tmp/plot.log').returncode, 0)


if __name__ == '__main__':
    os.environ.pop('ROS_MASTER_URI', None)
    unittest.main(argv=sys.argv[:1], verbosity=2)
