"""wrong_claims.py on the sample: parts of a map, a covered camera; and a street of which the first 40 % are missing."""
import csv
import os
import subprocess
import sys
import unittest
from pathlib import Path

import numpy as np
from program_runner import PROGRAMS, TIMEOUT_S, ProgramTest, first_images, run

MAP_BAG, DRIVE, SCRIPTS = (Path(argument).resolve() for argument in sys.argv[2:5])
DATA = Path(os.environ.get('VISUAL_LOCALIZATION_DATA', '/nonexistent'))
sys.path.insert(0, str(SCRIPTS))
import wrong_claims  # noqa: E402
from local_frame import LocalFrame, fixes_of  # noqa: E402

IMAGES = 200  # of the drive: the first half
CONFIG = """
pairs:
  - {{name: the sample, map: {map}, drive: {drive}, wrong: 5, truth_topic: /ground_truth/fix,
     map_parameters: {{geometry/enabled: false}}, cases: [last 60 %, covered]}}
  - {{name: other, map: {map}, drive: {drive}, elsewhere: true, map_parameters: {{geometry/enabled: false}},
     cases: [whole]}}
"""


class WrongClaimsTest(ProgramTest):
    def count(self, config: str) -> subprocess.CompletedProcess:
        file = self.folder / 'claims.yaml'
        file.write_text(config, encoding='utf-8')
        return subprocess.run([sys.executable, str(SCRIPTS / 'wrong_claims.py'), str(file), str(self.folder / 'out'),
                               '--data', '/', '--programs', str(PROGRAMS)], capture_output=True, text=True,
                              timeout=3 * TIMEOUT_S, check=False)

    def test_counts_what_is_claimed_and_what_of_it_is_wrong(self):
        drive = first_images(DRIVE, IMAGES, self.folder / 'drive.bag')
        result = self.count(CONFIG.format(map=MAP_BAG, drive=drive))
        self.assertEqual(result.returncode, 0, result.stderr)
        out = self.folder / 'out'
        with open(out / 'claims.csv', newline='', encoding='utf-8') as file:
            rows = {(row['pair'], row['case']): row for row in csv.DictReader(file)}
        part, covered, other = (rows[key] for key in (('the sample', 'last 60 %'), ('the sample', 'covered'),
                                                       ('other', 'whole')))
        self.assertEqual((part['images'], part['wrong'], covered['wrong']), (str(IMAGES), '0', '0'))
        self.assertGreater(int(part['claims']), 20, 'the map begins at image 162')
        self.assertLess(int(part['claims']), 45, 'and hardly any ahead of it')
        self.assertGreater(int(covered['claims']), 120)
        self.assertLess(int(covered['claims']), 151, 'none while the camera is covered')
        self.assertGreater(int(other['claims']), 180)
        self.assertEqual(other['wrong'], other['claims'], 'as the drive is said to be elsewhere')
        self.assertIn(f'| other | whole | {IMAGES} | {other["claims"]} | {other["claims"]} |', result.stdout)
        self.assertIn('</svg>', (out / 'claims.svg').read_text(encoding='utf-8'))

    def test_says_what_is_wrong_with_the_configuration(self):
        for config, word in (('pairs: [{name: a, map: b}]', 'drive'),
                             (f'pairs: [{{name: a, map: {MAP_BAG}, drive: /none.bag}}]', '/none.bag'),
                             (f'pairs: [{{name: a, map: {MAP_BAG}, drive: {DRIVE}, case: whole}}]', 'case'),
                             (f'pairs: [{{name: a, map: {MAP_BAG}, drive: {DRIVE}, cases: [half]}}]', 'cases')):
            self.assert_refused(self.count(config), 1, 'wrong_claims', word)

    @unittest.skipUnless(DATA.exists(), 'VISUAL_LOCALIZATION_DATA is not set')
    def test_a_street_that_begins_where_poses_start_badly_has_landmarks(self):
        """In the first adjustment most images explain little of what they see."""
        bag, table = self.folder / 'part.bag', self.folder / 'images.csv'
        keeps = wrong_claims.PARTS['last 60 %']
        wrong_claims.copy(DATA / 'real/kitti03_map.bag', bag, wrong_claims.PAIR,
                          lambda i, n, message: message if keeps(i, n) else False, ends=True)
        result = run('map_builder', '--bag', bag, '--camera-info', DATA / 'real/kitti03.yaml', '--output',
                     self.folder / 'part.map')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('120 of 120 images with landmarks', result.stdout)
        self.assertNotIn('check before use', result.stdout)
        run('map_info', self.folder / 'part.map', '--export-csv', table)
        with open(table, newline='', encoding='utf-8') as file:
            first = next(csv.DictReader(file))
        truth = fixes_of(bag, '/gps/fix')
        frame = LocalFrame(first)
        with open(table, newline='', encoding='utf-8') as file:
            for row in csv.DictReader(file):
                true = frame.position(*[np.interp([float(row['stamp'])], truth[:, 0], truth[:, axis])
                                        for axis in (1, 2)])[0]
                self.assertLess(abs(true - [float(row['east_m']), float(row['north_m'])]).max(), 1.0)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
