"""`evaluate` as a user meets it, on the first seconds of the recordings that ship."""
import csv
import math
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from typing import Optional

import rosbag

from program_runner import PROGRAMS, ProgramTest, run

ROUNDS, SAMPLE = (Path(argument) for argument in sys.argv[2:4])
TOPICS = ['/stereo/left/image_raw/compressed', '/gps/fix', '/ground_truth/fix']

TABLES = ('methods.csv', 'pairs.csv', 'steps.csv', 'summary.csv', 'traces.csv')
TIMES = ('ms_per_image', 'extract_ms', 'match_ms', 'update_ms')
METHODS = ('DPSO-80', 'PF-g-100', 'best single image')
SECONDS = 12.0


def first_seconds(source: Path, target: Path) -> None:
    with rosbag.Bag(str(source)) as whole, rosbag.Bag(str(target), 'w') as part:
        for topic, message, stamp in whole.read_messages(TOPICS, raw=True):
            if stamp.to_sec() <= whole.get_start_time() + SECONDS:
                part.write(topic, message, stamp, raw=True)


def short_sample() -> str:
    """The sample experiment with few methods and starts."""
    yaml = SAMPLE.read_text(encoding='utf-8').replace('starts: 8', 'starts: 2')
    yaml = re.sub(r'bag: \S+/(\w+\.bag)', r'bag: \1', yaml)
    lines = [line for line in yaml.splitlines()
             if not line.startswith('  - {name: ') or any(f'name: {name},' in line for name in METHODS)]
    return '\n'.join(lines) + '\n'


CALIBRATION = """image_width: 320
image_height: 240
camera_name: left
camera_matrix: {rows: 3, cols: 3, data: [266.28, 0, 159.5, 0, 266.28, 119.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [266.28, 0, 159.5, 0, 0, 266.28, 119.5, 0, 0, 0, 1, 0]}
"""


def true_poses(bag: Path) -> str:
    """Poses along the true positions, from an origin of their own; the camera looks east."""
    with rosbag.Bag(str(bag)) as messages:
        fixes = [message for _, message, _ in messages.read_messages(['/ground_truth/fix'])]
    lines = ['stamp_ns,east_m,north_m,yaw_rad']
    for fix in fixes:
        east = math.radians(fix.longitude - fixes[0].longitude) * 6378137 * math.cos(math.radians(fix.latitude))
        north = math.radians(fix.latitude - fixes[0].latitude) * 6378137
        lines.append(f'{fix.header.stamp.to_nsec()},{100 + east:.4f},{north:.4f},0.0')
    return '\n'.join(lines) + '\n'


def tables(folder: Path) -> dict:
    """The rows of all tables, without times."""
    rows = {}
    for name in TABLES:
        with open(folder / name, newline='', encoding='utf-8') as file:
            rows[name] = [{key: row[key] for key in row if key not in TIMES} for row in csv.DictReader(file)]
    return rows


def units(folder: Path) -> dict:
    """The results that are stored, with their bytes."""
    return {path.name: path.read_bytes() for path in sorted((folder / 'units').glob('*'))}


class EvaluateTest(ProgramTest):
    """One whole run is shared; the tests arrive at its tables in other ways."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.rounds = Path(folder.name)
        for bag in ROUNDS.glob('*.bag'):
            first_seconds(bag, cls.rounds / bag.name)
        cls.config = cls.rounds / 'short.yaml'
        cls.config.write_text(short_sample(), encoding='utf-8')
        cls.whole = cls.rounds / 'whole'
        cls.result = run('evaluate', '--config', cls.config, '--output', cls.whole)

    def setUp(self):
        super().setUp()
        self.output = self.folder / 'out'

    def evaluate(self, *arguments, config: Path = None, **options) -> subprocess.CompletedProcess:
        """Runs the short sample, or another experiment on the same rounds, without a report."""
        return run('evaluate', '--config', config or self.config, '--rounds', self.rounds, '--output', self.output,
                   '--no-report', *arguments, **options)

    def assert_done(self, result: subprocess.CompletedProcess):
        """Success, with the tables of the whole run and nothing half-written."""
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        self.assertEqual(tables(self.output), tables(self.whole))
        self.assertEqual(list(self.output.rglob('*.partial')), [])

    def edited(self, part: str, replacement: str) -> Path:
        text = short_sample()
        self.assertIn(part, text)
        config = self.folder / 'edited.yaml'
        config.write_text(text.replace(part, replacement), encoding='utf-8')
        return config

    def test_an_experiment_ends_in_tables_a_report_and_figures(self):
        self.assertEqual(self.result.returncode, 0, self.result.stderr)
        summary = tables(self.whole)['summary.csv']
        self.assertEqual({row['method'] for row in summary}, set(METHODS))
        self.assertEqual({(row['train_group'], row['test_group']) for row in summary},
                         {('sunny', 'cloudy'), ('cloudy', 'sunny')})
        best = [float(row['mean_err_m']) for row in summary if row['method'] == 'best single image']
        self.assertLess(max(best), 5.0)
        self.assertIn('DPSO-80', (self.whole / 'report.md').read_text(encoding='utf-8'))
        self.assertTrue(list((self.whole / 'figures').glob('*.svg')))

    def test_by_the_authors_program_the_methods_have_the_order_of_the_papers(self):
        """The central claim of the swarm: half of the comparisons of PF-l-100, at a smaller error."""
        text = SAMPLE.read_text(encoding='utf-8').replace('starts: 8', 'starts: 4')
        keep = ('DPSO-80', 'PF-l-100', 'PF-l-300')
        config = self.folder / 'order.yaml'
        config.write_text('\n'.join(line for line in text.splitlines() if not line.startswith('  - {name: ') or
                                    any(f'name: {name},' in line for name in keep)) + '\n', encoding='utf-8')
        for preset in ('paper_program', 'paper'):
            output = self.folder / preset
            result = run('evaluate', '--config', config, '--rounds', SAMPLE.parent, '--output', output, '--no-report',
                         '--preset', preset)
            self.assertEqual((result.returncode, result.stderr), (0, ''))
        by_group = {}
        for row in tables(self.folder / 'paper_program')['summary.csv']:
            by_group.setdefault((row['train_group'], row['test_group']), {})[row['method']] = row
        self.assertEqual(len(by_group), 2)
        for methods in by_group.values():
            comparisons = {name: float(row['comparisons_per_image']) for name, row in methods.items()}
            errors = {name: float(row['mean_err_m']) for name, row in methods.items()}
            self.assertLess(comparisons['DPSO-80'], 0.6 * comparisons['PF-l-100'])
            self.assertLess(comparisons['DPSO-80'], 0.35 * comparisons['PF-l-300'])
            self.assertLess(errors['DPSO-80'], errors['PF-l-100'])
        text_rows = {(row['train_group'], row['method']): row for row in
                     tables(self.folder / 'paper')['summary.csv']}
        self.assertGreater(float(text_rows['sunny', 'DPSO-80']['comparisons_per_image']),
                           0.8 * float(text_rows['sunny', 'PF-l-100']['comparisons_per_image']),
                           'plain weights: the claim needs the scaled selection')

    def test_the_ellipse_that_is_published_holds_the_truth(self):
        text = SAMPLE.read_text(encoding='utf-8').replace('starts: 8', 'starts: 2\nmap_parameters: {geometry/enabled: true}')
        config = self.folder / 'ellipse.yaml'
        config.write_text('\n'.join(line for line in text.splitlines() if not line.startswith('  - {name: ') or
                                    'name: Bayes filter,' in line) + '\n', encoding='utf-8')
        result = run('evaluate', '--config', config, '--rounds', SAMPLE.parent, '--output', self.output, '--no-report')
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        for row in tables(self.output)['summary.csv']:
            self.assertGreater(float(row['metric_share']), 0.95)
            self.assertGreater(float(row['inside_95_share']), 0.9)
            self.assertGreater(float(row['nees']), 0.25, 'not by a sigma that is three times too large')

    def metric(self, camera_info: str = CALIBRATION, poses: Optional[str] = None) -> Path:
        """The short sample with landmarks, a calibration and true poses beside the bags, which are copied."""
        for bag in self.rounds.glob('*.bag'):
            (self.folder / bag.name).write_bytes(bag.read_bytes())
            (self.folder / bag.with_suffix('.csv').name).write_text(poses or true_poses(bag), encoding='utf-8')
        (self.folder / 'camera.yaml').write_text(camera_info, encoding='utf-8')
        text = re.sub(r'bag: (\w+)\.bag', r'bag: \1.bag, poses: \1.csv', short_sample())
        text = text.replace('  bags:', '  camera_info: camera.yaml\n  bags:')
        text = text.replace('starts: 2', 'starts: 2\nmap_parameters: {geometry/enabled: true}')
        text = text.replace('\nmethods:', '\nmethods:\n  - {name: places, tracker: bayes, parameters: {pose_source: place}}')
        config = self.folder / 'metric.yaml'
        config.write_text(text, encoding='utf-8')
        return config

    def evaluate_metric(self, config: Path) -> subprocess.CompletedProcess:
        """Runs an experiment beside its bags."""
        return run('evaluate', '--config', config, '--output', self.output)

    def test_poses_are_solved_and_judged(self):
        result = self.evaluate_metric(self.metric())
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        summary = {row['method']: row for row in tables(self.output)['summary.csv']}
        self.assertGreater(float(summary['DPSO-80']['metric_share']), 0.5)
        self.assertEqual(float(summary['places']['metric_share']), 0.0)
        self.assertLess(float(summary['DPSO-80']['relative_err_m']), float(summary['places']['relative_err_m']))
        self.assertEqual(summary['best single image']['heading_err_deg'], '')
        report = (self.output / 'report.md').read_text(encoding='utf-8')
        self.assertIn('## Poses: recall within position and heading', report)
        trajectory = self.output / 'trajectories' / 'DPSO-80__sunny_1__cloudy_1__0.tum'
        rows = [[float(number) for number in line.split()] for line in trajectory.read_text().splitlines()]
        self.assertEqual({len(row) for row in rows}, {8})
        self.assertEqual(len(rows), len(trajectory.with_suffix('.truth.tum').read_text().splitlines()))
        self.assertAlmostEqual(sum(number ** 2 for number in rows[0][4:]), 1.0, 6)

    def test_files_beside_the_bags_must_be_right(self):
        header = 'stamp_ns,east_m,north_m,yaw_rad\n'
        for camera_info, poses, word in (
                (CALIBRATION.replace('[266.28, 0, 159.5, 0, 266.28', '[-1, 0, 159.5, 0, 266.28'), None, 'camera.yaml'),
                (CALIBRATION.replace('height: 240', 'height: 500'), None, 'another shape'),
                ('words', None, 'camera.yaml'),
                (CALIBRATION, header + '1,nan,0,0\n', "line 2: east_m = 'nan'"),
                (CALIBRATION, header + '1,0,0,0\n2,0,0,0\n', '.csv: no pose is from the time')):
            with self.subTest(word=word):
                self.assert_refused(self.evaluate_metric(self.metric(camera_info, poses)), 1, word)

    def test_results_bind_the_files_beside_the_bags(self):
        config = self.metric()
        for name in ('camera.yaml', 'campus_sunny_1.csv'):
            with self.subTest(name=name):
                path = self.folder / name
                kept = path.read_text(encoding='utf-8')
                path.unlink()
                self.assert_refused(self.evaluate_metric(config), 1, name, 'cannot be read')
                path.write_text(kept, encoding='utf-8')
        self.assertEqual(self.evaluate_metric(config).returncode, 0)
        poses = self.folder / 'campus_sunny_1.csv'
        poses.write_text(poses.read_text(encoding='utf-8').replace(',0.0\n', ',0.1\n'), encoding='utf-8')
        self.assert_refused(self.evaluate_metric(config), 1, 'provenance.csv differs')

    def test_results_of_another_format_are_refused(self):
        self.assert_done(self.evaluate('--merge', self.whole))
        provenance = self.output / 'provenance.csv'
        text = provenance.read_text(encoding='utf-8')
        self.assertIn('unit_format,4\n', text)
        provenance.write_text(text.replace('unit_format,4\n', ''), encoding='utf-8')
        self.assert_refused(self.evaluate(), 1, 'another version (provenance.csv differs)')

    def test_the_report_can_be_drawn_again(self):
        report = (self.whole / 'report.md').read_text(encoding='utf-8')
        result = run('report_evaluation.py', self.whole)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual((self.whole / 'report.md').read_text(encoding='utf-8'), report)

    def test_a_report_that_fails_is_one_line_and_leaves_the_tables(self):
        self.assert_done(self.evaluate('--merge', self.whole))
        (self.output / 'report.md').mkdir()
        result = run('evaluate', '--config', self.config, '--output', self.output)
        self.assert_refused(result, 1, 'report.md', 'the tables are written')

    def test_an_output_may_begin_with_a_dash(self):
        result = run('evaluate', '--config', self.config, '--output=-o', '--merge', self.whole, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue((self.folder / '-o' / 'report.md').exists())

    def test_shards_merged_are_the_whole(self):
        parts = [self.folder / name for name in ('second', 'first')]
        for part, shard in zip(parts, ('2/2', '1/2')):
            result = run('evaluate', '--config', self.config, '--output', part, '--shard', shard)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertFalse((part / 'summary.csv').exists())
        self.assert_refused(self.evaluate('--merge', parts[0]), 1, "map sunny_1 and drive cloudy_1 is missing")
        self.assert_done(self.evaluate('--merge', *parts))
        self.assert_done(self.evaluate('--merge', self.output))

    def test_an_interrupted_run_goes_on(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(signal=number):
                self.output = self.folder / f'out{number}'
                command = [str(PROGRAMS / 'evaluate'), '--config', str(self.config), '--output', str(self.output),
                           '--no-report', '--threads', '1']
                with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
                    while process.poll() is None and not list(self.output.glob('units/*.csv')):
                        time.sleep(0.002)
                    process.send_signal(number)
                    errors = process.communicate(timeout=20)[1]
                self.assertEqual((process.returncode, errors), (-number, ''))
                kept = units(self.output)
                self.assertLess(len(kept), 2 * len(METHODS))
                self.assertEqual([name for name in kept if not name.endswith('.csv')], [])
                self.assert_done(self.evaluate())
                self.assertEqual({name: units(self.output)[name] for name in kept}, kept)

    def test_a_full_disk_is_one_line_and_the_next_run_goes_on(self):
        # Results of the trackers do not fit, whatever number of digits their times have; the others fit.
        size = max(map(len, units(self.whole).values())) // 2

        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        self.assert_refused(self.evaluate(preexec_fn=limit), 1, 'units/pair', 'cannot be written')
        self.assertEqual([name for name in units(self.output) if not name.endswith('.csv')], [])
        self.assert_done(self.evaluate())

    def test_a_damaged_result_is_made_anew(self):
        self.assert_done(self.evaluate('--merge', self.whole))
        damaged = self.output / 'units' / 'pair1_method0.csv'
        damaged.write_bytes(damaged.read_bytes()[:1000])
        self.assert_refused(self.evaluate('--merge', self.output), 1, 'pair1_method0.csv: is damaged')
        self.assert_done(self.evaluate())

    def test_results_of_another_configuration_stay_as_they_are(self):
        before = units(self.whole)
        self.output = self.whole
        self.assert_refused(self.evaluate(config=self.edited('starts: 2', 'starts: 3')), 1, 'another configuration')
        self.assertEqual(units(self.whole), before)

    def test_a_failed_attempt_does_not_bind_the_output(self):
        wrong = self.edited('truth_topic: /ground_truth/fix', 'truth_topic: /ground_truth/fox')
        self.assert_refused(self.evaluate(config=wrong), 1, '.bag', '/ground_truth/fox')
        self.assert_done(self.evaluate())

    def test_an_experiment_may_come_through_a_pipe(self):
        with subprocess.Popen(['cat', str(self.config)], stdout=subprocess.PIPE) as pipe:
            self.assert_done(self.evaluate(config=Path('/dev/stdin'), stdin=pipe.stdout))
        self.assertEqual((self.output / 'experiment.yaml').read_text(encoding='utf-8'), short_sample())

    def test_bad_usage_is_code_2(self):
        for arguments, word in ((('--shard', '3/2'), 'I from 1 to N'), (('--shard', '0/2'), 'I from 1 to N'),
                                (('--shard', '1/2x'), 'I from 1 to N'), (('--shard', ''), 'I from 1 to N'),
                                (('--shard', '9' * 30 + '/' + '9' * 30), 'I from 1 to N'),
                                (('--shard', '2'), 'I from 1 to N'), (('--shard', '-1/2'), 'I from 1 to N'),
                                (('--threads', '0'), '1024'), (('--threads', '-1'), '1024'),
                                (('--threads', '9' * 30), '1024'), (('--threads', 'all'), '1024'),
                                (('--merge', self.folder / 'absent'), 'absent'), (('--nonsense',), 'nonsense')):
            with self.subTest(arguments=arguments):
                self.assert_refused(self.evaluate(*arguments), 2, *map(str, arguments), word)
        self.assert_refused(self.evaluate('--shard', '1/2', '--merge', self.whole), 2, '--shard', '--merge')
        self.assert_refused(run('evaluate', '--config', self.config), 2, '--output')
        self.assert_refused(run('evaluate', '--config', self.config, '--output='), 2, '--output')

    def test_a_mistake_in_the_experiment_is_one_line_and_leaves_nothing(self):
        for part, replacement, word in (('starts: 2', 'starts: -2', "'starts' = -2"),
                                        ('starts: 2', 'start: 2', "'start' is unknown"),
                                        ('campus_sunny_1.bag', 'absent.bag', 'absent.bag'),
                                        ('[sunny, cloudy]', '[sunny, sunny]', 'needs two different rounds')):
            with self.subTest(replacement=replacement):
                self.assert_refused(self.evaluate(config=self.edited(part, replacement)), 1, word)
        self.assert_refused(self.evaluate(config=self.folder), 1, str(self.folder), 'cannot be read')
        self.assert_refused(self.evaluate(config=self.folder / 'absent.yaml'), 1, 'absent.yaml: cannot be read')
        self.assertFalse(self.output.exists())

    def test_a_folder_without_results_is_not_merged_nor_changed(self):
        photos = self.folder / 'photos'
        photos.mkdir()
        self.assert_refused(self.evaluate('--merge', photos), 1, 'photos: is not a folder of results')
        self.assertEqual(list(photos.iterdir()), [])


if __name__ == '__main__':
    os.environ.pop('ROS_MASTER_URI', None)
    unittest.main(argv=sys.argv[:1], verbosity=2)
