"""The programs as a user meets them: results, exit codes, one line of error, nothing half-written."""
import csv
import math
import os
import signal
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

from program_runner import PROGRAMS, ProgramTest, first_images, run

MAP, DRIVE, CONFIG, CALIBRATION = (Path(argument) for argument in sys.argv[2:6])
HEADER = ('stamp,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,state,similarity,features,comparisons,'
          'extract_ms,match_ms,update_ms,source,inliers,reprojection_px,sigma_m,sigma_yaw_rad,swept,'
          'probability,off_map,reason,best_image,matches,features_kept,threshold,unconfirmed,rival_image,rival_east_m,'
          'rival_north_m,rival_probability,reason_figure,reason_east_m,reason_north_m,mean_grey,latency_ms,'
          'explanation').split(',')
WORDS = ('state', 'features', 'source', 'reason', 'explanation')
UNKNOWN = ('rival_image', 'rival_east_m', 'rival_north_m', 'rival_probability', 'reason_east_m', 'reason_north_m')
TIMES = ('extract_ms', 'match_ms', 'update_ms', 'latency_ms')


def read_track(path: Path) -> list:
    with open(path, newline='', encoding='utf-8') as file:
        return list(csv.DictReader(file))


def positions(rows: list) -> list:
    """All of a track but the times that it took."""
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


class ProgramsTest(ProgramTest):
    """All programs but `evaluate`."""

    @classmethod
    def setUpClass(cls):
        """A short drive, for what shows within a few images."""
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.short = first_images(DRIVE, 80, Path(folder.name) / 'short.bag')

    def localize(self, *arguments, bag=DRIVE) -> list:
        track = self.folder / 'track.csv'
        result = run('localize', '--map', MAP, '--bag', bag, '--output', track, *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.output = result.stdout
        return read_track(track)

    def test_track_has_a_row_for_every_image_and_follows_the_robot(self):
        rows = self.localize('--seed', 1, '--truth-topic', '/ground_truth/fix')
        self.assertEqual(list(rows[0]), HEADER)
        self.assertEqual(len(rows), 403)
        for row in rows:
            for name in HEADER:
                if name not in WORDS and (row[name] or name not in UNKNOWN):
                    self.assertTrue(math.isfinite(float(row[name])), row)
            confirmed = row['reason'] in ('LANDMARKS', 'ALONG_THE_WAY')
            self.assertEqual(row['state'] == 'TRACKING', confirmed, row)
        self.assertGreater(sum(row['state'] == 'TRACKING' for row in rows), 0.95 * len(rows))
        self.assertGreater(sum(row['source'] == 'METRIC' for row in rows), 0.9 * len(rows))
        error = float(self.output.split('mean ')[1].split(' m')[0])
        self.assertLess(error, 0.25)

    def test_track_says_how_it_came_about_and_why(self):
        rows = self.localize('--seed', 7, '--pose-source', 'place', bag=self.short)
        lines = (self.folder / 'track.csv.yaml').read_text(encoding='utf-8').splitlines()
        header = dict(line.split(': ', 1) for line in lines if ': ' in line)
        self.assertEqual(header['map'], f'"{MAP}"')
        self.assertEqual(header['map_crc32'], f'"{zlib.crc32(MAP.read_bytes()):08x}"')
        self.assertEqual(header['seed'], '7')
        self.assertEqual(header['  state/min_probability'], '"0.97"')
        self.assertIn('320 x 240', header['camera'])
        share = 100 * sum(row['state'] == 'TRACKING' for row in rows) / len(rows)
        self.assertIn(f'TRACKING {share:.1f} %: ALONG_THE_WAY {share:.1f} %\n', self.output)
        self.assertEqual(rows[0]['reason'], 'NOT_SURE_YET')
        self.assertTrue(rows[0]['explanation'].startswith('Not sure yet'), rows[0])

    def test_pose_source_chooses_between_landmarks_and_places(self):
        rows = self.localize('--pose-source', 'place', '--config', CONFIG)
        self.assertEqual({row['source'] for row in rows} - {'PLACE', 'NONE'}, set())
        self.assert_refused(run('localize', '--map', MAP, '--bag', DRIVE, '--output', self.folder / 'no.csv',
                                '--pose-source', 'gps'), 2, 'pose_source')

    def test_a_preset_is_complete_from_the_bag_to_the_table(self):
        config = self.folder / 'config.yaml'
        built = self.folder / 'paper.map'
        result = run('map_builder', '--bag', self.short, '--preset', 'paper', '--output', built)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn('landmarks:', result.stdout)
        tracks = {}
        for preset in ('paper', 'paper_program'):
            track = self.folder / 'track.csv'
            arguments = ('localize', '--map', built, '--bag', self.short, '--preset', preset, '--output', track)
            result = run(*arguments)
            self.assertEqual(result.returncode, 0, result.stderr)
            tracks[preset] = positions(read_track(track))
            self.assertEqual({row['source'] for row in read_track(track)} - {'PLACE', 'NONE'}, set())
            config.write_text('dpso: {phi0: 1.5}\n', encoding='utf-8')
            self.assert_refused(run(*arguments, '--config', config), 1,
                                f"'dpso/phi0' = 1.5 contradicts preset '{preset}': must be 0.3")
            self.assert_refused(run(*arguments, '--match', 'votes'), 2,
                                f"'match/mode' = votes contradicts preset '{preset}': must be one of symmetric, one_way")
        self.assertNotEqual(tracks['paper'], tracks['paper_program'])
        result = run('localize', '--map', MAP, '--bag', self.short, '--preset', 'paper', '--output', self.folder / 'out')
        self.assert_refused(result, 1, "preset 'paper' is not allowed with this map", "'sift/upright' = true instead of",
                            'adjusted positions', 'map_builder --preset paper')
        result = run('localize', '--map', MAP, '--bag', DRIVE, '--preset', 'thesis', '--output', self.folder / 'out')
        self.assert_refused(result, 2, "preset 'thesis' is not allowed: must be one of paper, paper_program")
        result = run('map_builder', '--bag', self.short, '--preset', 'paper', '--spacing', '2', '--output', built)
        self.assert_refused(result, 2, "--spacing: parameter 'map/spacing' = 2 contradicts preset 'paper': must be 0")

    def test_same_seed_gives_the_same_track_another_seed_another_one(self):
        swarm = ('--tracker', 'dpso', '--pose-source', 'place')  # the Bayes filter draws nothing that moves its pose
        first = positions(self.localize('--seed', 5, *swarm, bag=self.short))
        self.assertEqual(first, positions(self.localize('--seed', 5, *swarm, bag=self.short)))
        self.assertNotEqual(first, positions(self.localize('--seed', 6, *swarm, bag=self.short)))

    def test_start_index_wraps_around_the_drive(self):
        rows = self.localize('--start-index', 400, '--config', CONFIG)
        stamps = [float(row['stamp']) for row in rows]
        self.assertEqual(len(stamps), 403)
        self.assertEqual(stamps.index(min(stamps)), 3)

    def test_bad_usage_is_code_2(self):
        output = self.folder / 'track.csv'
        good = ('--map', MAP, '--bag', DRIVE, '--output', output)
        for extra, word in ((('--tracker', 'crystal_ball'), 'dpso'), (('--particles', '-3'), '[2, 100000]'),
                            (('--start-index', 403), '0 to 402'), (('--start-index', -1), "--start-index: '-1'"), (('--kidnap-at', 3), '--kidnap-to'),
                            (('--nonsense', 1), '--nonsense')):
            self.assert_refused(run('localize', *good, *extra), 2, word)
        for extra, words in ((('--threads', '0'), ('--threads', '0 not in range', '1024')),
                             (('--threads', 'all'), ('--threads', 'all not in range', '1024')),
                             (('--min-spacing', '-1'), ('--min-spacing', '-1', '[0, 1000]')),
                             (('--plot', 'plot.txt'), ('--plot', 'plot.txt', '.png, .svg, .pdf or .html')),
                             (('--plot', 'png'), ('--plot', "'png'", '.png, .svg, .pdf or .html'))):
            with self.subTest(extra=extra):
                self.assert_refused(run('map_builder', '--bag', DRIVE, '--output', output, *extra), 2, *words)
        self.assert_refused(run('map_info', MAP, '--few-features', '-1'), 2, '--few-features', '-1', '1000000')
        self.assert_refused(run('localize', '--map', MAP), 2, '--bag')
        self.assert_refused(run('map_info'), 2)
        self.assert_refused(run('map_builder'), 2)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_failed_run_is_code_1_and_leaves_nothing(self):
        output = self.folder / 'output'
        damaged = self.folder / 'damaged.bag'
        damaged.write_bytes(DRIVE.read_bytes()[:1000000])
        for arguments, word in (((MAP, damaged), 'damaged.bag'), ((damaged, DRIVE), 'damaged.bag'),
                                ((MAP, self.folder / 'none.bag'), 'none.bag'), ((self.folder, DRIVE), 'folder')):
            result = run('localize', '--map', arguments[0], '--bag', arguments[1], '--output', output)
            self.assert_refused(result, 1, word)
        self.assert_refused(run('map_builder', '--bag', damaged, '--output', output), 1, 'damaged.bag')
        self.assert_refused(run('map_builder', '--bag', DRIVE, '--output', output, '--fix-topic', '/no'), 1, '/gps/fix')
        result = run('localize', '--map', MAP, '--bag', DRIVE, '--output', self.folder / 'no' / 'track.csv')
        self.assert_refused(result, 1, 'folder does not exist')
        self.assertEqual([path.name for path in self.folder.iterdir()], ['damaged.bag'])

    def test_names_from_outside_make_one_clear_line(self):
        hostile = 'a\nb\x1b[31m\x07'
        for result, code in ((run('map_info', hostile), 1), (run('localize', '--map', MAP, '--bag', hostile, '--output', 'o'), 1),
                             (run('map_builder', '--bag', DRIVE, '--output', self.folder / hostile / 'o'), 1),
                             (run('map_builder', '--bag', DRIVE, '--image-topic', hostile, '--output', self.folder / 'o'), 1),
                             (run('localize', '--map', MAP, hostile), 2), (run('map_info', 'x' * 100000), 1)):
            self.assert_refused(result, code)
            self.assertFalse(set(map(chr, range(32))) - {'\n'} & set(result.stderr), result.stderr)
            self.assertLess(len(result.stderr), 11000)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_file_without_end_is_no_configuration(self):
        for arguments in (('map_builder', '--bag', DRIVE), ('localize', '--map', MAP, '--bag', DRIVE), ('evaluate',)):
            result = run(*arguments, '--output', self.folder / 'output', '--config', '/dev/zero')
            self.assert_refused(result, 1, '/dev/zero', 'neither a file nor a pipe')

    def test_a_path_that_sqlite_does_not_take_is_named_as_that(self):
        deep = self.folder / ('a' * 200) / ('b' * 200) / ('c' * 200)
        deep.mkdir(parents=True)
        (deep / 'copy.map').write_bytes(MAP.read_bytes())
        self.assert_refused(run('map_info', deep / 'copy.map'), 1, 'cannot be opened', '512 bytes')
        self.assert_refused(run('map_builder', '--bag', DRIVE, '--output', deep / 'o.map'), 1, 'cannot be written', '512 bytes')
        self.assertEqual([path.name for path in deep.iterdir()], ['copy.map'])

    def test_an_output_never_replaces_an_input(self):
        copy, bag = self.folder / 'copy.map', self.folder / 'copy.bag'
        copy.write_bytes(MAP.read_bytes())
        bag.write_bytes(DRIVE.read_bytes())
        for result in (run('localize', '--map', copy, '--bag', DRIVE, '--output', copy),
                       run('map_builder', '--bag', bag, '--output', bag),
                       run('map_builder', '--bag', bag, '--output', self.folder / 'new.svg', '--plot', self.folder / 'new.svg'),
                       run('map_info', copy, '--export-csv', self.folder / '.' / 'copy.map')):
            self.assert_refused(result, 2, 'would overwrite')
        self.assertEqual(copy.read_bytes(), MAP.read_bytes())
        self.assertEqual(bag.read_bytes(), DRIVE.read_bytes())

    def test_the_calibration_is_that_of_option_bag_or_map(self):
        other = self.folder / 'other.yaml'
        other.write_text(CALIBRATION.read_text(encoding='utf-8').replace('266.2847172', '300.0'), encoding='utf-8')
        self.localize(bag=self.short)
        self.assertIn('camera: 320 x 240 px, focal length 266.3 x 266.3 px, no distortion, from /stereo/left/camera_info\n',
                      self.output)
        self.assertNotIn("not the map's", self.output)
        self.localize('--camera-info', other, bag=self.short)
        self.assertIn(f'focal length 300 x 300 px, no distortion, from {other}\n', self.output)
        self.assertIn("camera: not the map's: fx 300 instead of 266.285", self.output)
        self.assertIn('cameras:     320 x 240 px, focal length 266.3', run('map_info', MAP).stdout)

    def test_an_impossible_calibration_or_mask_is_refused(self):
        bad, mask, output = (self.folder / name for name in ('bad.yaml', 'mask.png', 'out'))
        bad.write_text(CALIBRATION.read_text(encoding='utf-8').replace('[266.2847172', '[.nan'), encoding='utf-8')
        mask.write_bytes(b'\x89PNG\r\n')
        for program in (('map_builder', '--bag', DRIVE), ('localize', '--map', MAP, '--bag', DRIVE)):
            for option, path, word in (('--camera-info', bad, 'fx = nan'), ('--mask', mask, 'is not a PNG image'),
                                       ('--camera-info', self.folder / 'none.yaml', 'No such file')):
                self.assert_refused(run(*program, '--output', output, option, path), 1, path.name, word)
            self.assert_refused(run(*program, '--output', bad, '--camera-info', bad), 2, 'would overwrite')
        self.assertFalse(output.exists())

    def test_the_adjustment_takes_the_features_that_pruning_drops(self):
        tables = []
        for prune in ('true', 'false'):
            config, output, table = (self.folder / f'{prune}.{ending}' for ending in ('yaml', 'map', 'csv'))
            config.write_text(f'map: {{prune: {prune}}}\n', encoding='utf-8')
            for command in (('map_builder', '--bag', self.short, '--config', config, '--output', output),
                            ('map_info', output, '--export-csv', table)):
                result = run(*command)
                self.assertEqual(result.returncode, 0, result.stderr)
            tables.append(read_track(table))
        pruned, unpruned = ([(row['stamp'], row['east_m'], row['north_m'], row['yaw_rad']) for row in table]
                            for table in tables)
        self.assertGreater(len(pruned), 5)
        self.assertEqual(pruned, unpruned)
        self.assertGreater(sum(int(row['features']) for row in tables[1]),
                           1.5 * sum(int(row['features']) for row in tables[0]))

    def test_an_unknown_parameter_is_named(self):
        config = self.folder / 'config.yaml'
        config.write_text('dpso:\n  inertai: 0.5\n', encoding='utf-8')
        result = run('localize', '--map', MAP, '--bag', DRIVE, '--config', config, '--output', self.folder / 'out')
        self.assert_refused(result, 1, 'config.yaml', "'dpso/inertai' = 0.5")

    def test_a_killed_builder_leaves_the_old_map(self):
        output = self.folder / 'old.map'
        output.write_bytes(MAP.read_bytes())
        for number in (signal.SIGTERM, signal.SIGINT):
            command = [str(PROGRAMS / 'map_builder'), '--bag', str(DRIVE), '--output', str(output)]
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                self.assertRaises(subprocess.TimeoutExpired, process.wait, 0.7)
                process.send_signal(number)
                self.assertNotEqual(process.wait(20), 0)
        self.assertEqual(output.read_bytes(), MAP.read_bytes())
        self.assertEqual([path.name for path in self.folder.iterdir()], ['old.map'])

    def test_one_builder_at_a_time_and_the_next_one_clears_up(self):
        command = [str(PROGRAMS / 'map_builder'), '--bag', str(DRIVE), '--output', str(self.folder / 'new.map')]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as first:
            self.assertRaises(subprocess.TimeoutExpired, first.wait, 0.7)
            self.assert_refused(run(*command), 1, 'new.map: cannot be written', f'process {first.pid} on ')
            first.kill()
        self.assertTrue(list(self.folder.glob('new.map.*.partial')))
        result = run(*command)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual([path.name for path in self.folder.iterdir()], ['new.map'])

    def test_map_info_shows_checks_and_exports(self):
        geojson, table = self.folder / 'map.geojson', self.folder / 'map.csv'
        result = run('map_info', MAP, '--check', '--export-geojson', geojson, '--export-csv', table)
        self.assertEqual(result.returncode, 0, result.stderr)
        kept = len(read_track(table))
        self.assertTrue(90 <= kept <= 140, kept)  # of 404, at least 2 m apart on a round of 260 m
        self.assertIn('%d of 320x240' % kept, result.stdout)
        self.assertIn('FeatureCollection', geojson.read_text(encoding='utf-8'))

    def test_help_and_version(self):
        for program in ('map_builder', 'map_info', 'localize', 'evaluate'):
            for option in ('--help', '--version'):
                result = run(program, option)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn(program, result.stdout)

    def test_a_vector_target_is_shown_forced_and_refused(self):
        def with_target(target, program, *arguments):
            return run(program, *arguments, env={**os.environ, 'VISUAL_LOCALIZATION_TARGET': target})

        for program in ('map_builder', 'map_edit', 'map_info', 'localize', 'evaluate', 'localizer_node',
                        'map_recorder'):
            forced = with_target('portable', program, '--version')
            self.assertRegex(forced.stdout, program + r' [\d.]+ \((portable|SSE2|NEON)\)\n')
            wrong = with_target('AVX9', program, '--version')
            self.assert_refused(wrong, 1 if program == 'map_recorder' else 2,
                                "VISUAL_LOCALIZATION_TARGET: 'AVX9' is not one of portable")
        self.assert_refused(with_target('', 'map_info', MAP), 2, "'' is not one of portable")


if __name__ == '__main__':
    os.environ.pop('ROS_MASTER_URI', None)
    unittest.main(argv=sys.argv[:1], verbosity=2)
