"""report_track.py on made-up tracks: what it says of metric poses, and what it draws beside them."""
import csv
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(sys.argv[1])
METRES_PER_DEGREE = 111000.0  # nearly, of latitude


class ReportTrackTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def write(self, name: str, rows: list) -> Path:
        path = self.folder / name
        with open(path, 'w', newline='', encoding='utf-8') as file:
            writer = csv.DictWriter(file, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)
        return path

    def track(self, source: str) -> Path:
        """30 images along a street to the north, each 0.5 m beside the truth."""
        counts = dict.fromkeys(('dropped', 'late', 'refused', 'without_map'), 0)
        counts.update(dict.fromkeys(('in_bag', 'answered', 'received', 'processed'), 30))
        (self.folder / 'track.json').write_text(json.dumps(counts), encoding='utf-8')
        return self.write('track.csv', [
            {'stamp': 1000.0 + i, 'east_m': .5, 'north_m': i, 'latitude_deg': 48.5 + i / METRES_PER_DEGREE,
             'longitude_deg': 9.0, 'state': 'TRACKING', 'comparisons': 5, 'extract_ms': 1, 'match_ms': 1,
             'update_ms': 1, 'source': source, 'inliers': 40, 'sigma_m': .05, 'error_m': .5,
             'true_latitude_deg': 48.5 + i / METRES_PER_DEGREE, 'true_longitude_deg': 9.0} for i in range(30)])

    def report(self, *arguments) -> subprocess.CompletedProcess:
        return subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True,
                              timeout=100, check=False)

    def drawing(self) -> str:
        """The SVG: matplotlib notes as comments what its letters say."""
        return (self.folder / 'track.svg').read_text(encoding='utf-8')

    def test_metric_poses_are_told_and_drawn(self):
        result = self.report(self.track('METRIC'))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('metric poses     100.0 % of the answers, error median 0.50 m', result.stdout)
        self.assertIn('METRIC, median 0.50 m', self.drawing())
        self.assertNotIn('without landmarks', self.drawing())

    def test_the_error_without_landmarks_is_drawn_beside(self):
        track = self.track('METRIC')
        places = self.write('places.csv', [{'stamp': 1000.0 + i, 'east_m': 3.5, 'north_m': i} for i in range(5, 40)])
        result = self.report(track, '--places', places)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('without landmarks, median 3.00 m', self.drawing())

    def test_another_drive_is_not_drawn(self):
        places = self.write('places.csv', [{'stamp': 1.0, 'east_m': 0, 'north_m': 0}])
        self.assertEqual(self.report(self.track('PLACE'), '--places', places).returncode, 0)
        self.assertNotIn('without landmarks', self.drawing())
        self.assertIn('PLACE, median 0.50 m', self.drawing())


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
