"""plot_beside.py on a made-up drive: the sign and size of what it measures, and what it refuses."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[1] / 'plot_beside.py'
HEADER = 'stamp,east_m,north_m,source\n'


class PlotBesideTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.map, self.track = self.folder / 'map.csv', self.folder / 'track.csv'
        # North, then east: right of it is east, then south.
        path = [(0, y) for y in range(0, 21, 2)] + [(x, 20) for x in range(2, 21, 2)]
        self.map.write_text('east_m,north_m\n' + ''.join(f'{x},{y}\n' for x, y in path))

    def plot(self):
        picture = self.folder / 'beside.png'
        done = subprocess.run([sys.executable, str(SCRIPT), '--map', str(self.map), '--track', str(self.track),
                               '--output', str(picture)], capture_output=True, text=True, timeout=100, check=False)
        return done, picture

    def test_right_of_the_path_is_positive_and_only_poses_by_landmarks_count(self):
        self.track.write_text(HEADER + '1,1.5,5,METRIC\n2,1.5,9,METRIC\n3,9,18.5,METRIC\n4,-7,9,PLACE\n')
        done, picture = self.plot()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('3 poses, right of the path: median 1.50 m, quartiles 1.50 and 1.50 m, 100 % right', done.stdout)
        self.assertGreater(picture.stat().st_size, 5000)

    def test_left_is_negative(self):
        self.track.write_text(HEADER + '1,-2,5,METRIC\n')
        self.assertIn('median -2.00 m', self.plot()[0].stdout)

    def test_nothing_to_plot_and_bad_files_are_one_line(self):
        for text, reason in ((HEADER + '1,1,1,PLACE\n', 'no pose by landmarks'), ('stamp\n1\n', 'no column east_m'),
                             (HEADER + '1,far,1,METRIC\n', 'not a number'), (HEADER + '1,,1,METRIC\n', 'east_m')):
            self.track.write_text(text)
            done, picture = self.plot()
            self.assertEqual(done.returncode, 1, text)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertIn(reason, done.stderr)
            self.assertFalse(picture.exists())


if __name__ == '__main__':
    unittest.main()
