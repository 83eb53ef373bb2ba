"""map_edit as a user meets it: maps of maps, one line of error, nothing half-written."""
import csv
import json
import math
import re
import resource
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from program_runner import PROGRAMS, ProgramTest, run

MAP, SUNNY, CLOUDY, MAP_ERROR = (Path(argument) for argument in sys.argv[2:6])


class MapEditTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        """The sunny map with the cloudy recording, and a drive on it."""
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.both, cls.used = Path(folder.name) / 'both.map', Path(folder.name) / 'used.csv'
        cls.added = run('map_edit', 'add', '--map', MAP, '--bag', CLOUDY, '--output', cls.both)
        cls.driven = run('localize', '--map', cls.both, '--bag', CLOUDY, '--output', Path(folder.name) / 'track.csv',
                         '--truth-topic', '/ground_truth/fix', '--usage', cls.used)

    def setUp(self):
        super().setUp()
        self.output = self.folder / 'new.map'

    def edit(self, *arguments) -> str:
        """Runs a command that writes self.output; what it says."""
        result = run('map_edit', *arguments, '--output', self.output)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(run('map_info', '--check', self.output).returncode, 0)
        return result.stdout

    def refuse(self, code: int, *arguments, words=(), **options) -> str:
        """Runs a command that must fail in a line with these words, and leave nothing behind; what it said before."""
        before = sorted(path.name for path in self.folder.iterdir())
        result = run('map_edit', *arguments, '--output', self.output, **options)
        self.assert_refused(result, code, 'map_edit: ', *words)
        self.assertEqual(before, sorted(path.name for path in self.folder.iterdir()))
        return result.stdout

    def images(self, path: Path) -> list:
        """Rows of map_info's table of images."""
        table = self.folder / 'images.csv'
        result = run('map_info', path, '--export-csv', table)
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(table, newline='', encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        table.unlink()
        return rows

    def test_an_added_recording_lies_beside_the_old_one(self):
        self.assertEqual(self.added.returncode, 0, self.added.stderr)
        tied, apart, left = re.search(r'(\d+) tied to the maps before: median offset ([\d.]+) m before, '
                                      r'([\d.]+) m after', self.added.stdout).groups()
        old, rows = self.images(MAP), self.images(self.both)
        self.assertEqual(rows[:len(old)], old)
        new = rows[len(old):]
        self.assertEqual({row['session'] for row in new}, {'campus_cloudy_1'})
        self.assertGreater(int(tied), .9 * len(new))
        self.assertLess(float(left), .1)
        self.assertLess(float(left), float(apart))
        self.assertIn('edited:      add of campus_sunny_1.map, campus_cloudy_1.bag by map_edit',
                      run('map_info', self.both).stdout)
        self.assertLess(float(self.driven.stdout.split('mean ')[1].split(' m')[0]), .3, self.driven.stdout)

    def test_the_same_place_lies_once(self):
        command = [sys.executable, MAP_ERROR, '--map', self.both, '--bag', SUNNY, '--bag', CLOUDY, '--programs', PROGRAMS]
        result = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
        images, mean, most = re.search(r'same place as before at (\d+) images, apart mean ([\d.]+) m, 95 % ([\d.]+)',
                                       result.stdout).groups()
        self.assertGreater(int(images), 100)
        self.assertLess(float(mean), .1)
        self.assertLess(float(most), .2)

    def test_merged_maps_are_those_of_an_addition(self):
        cloudy = self.folder / 'cloudy.map'
        self.assertEqual(run('map_builder', '--bag', CLOUDY, '--output', cloudy).returncode, 0)
        self.edit('merge', MAP, cloudy)
        one = self.images(self.output)
        self.edit('merge', cloudy, MAP)
        self.assertEqual(one, self.images(self.output))
        added = self.images(self.both)
        self.assertEqual(len(one), len(added))
        sunny = [row for row in one if row['session'] == 'campus_sunny_1']
        self.assertEqual(len(sunny), len(self.images(MAP)))

    def test_a_removed_session_is_gone(self):
        self.edit('remove', '--map', self.both, '--session', 'campus_cloudy_1')
        self.assertEqual(self.images(self.output), self.images(MAP))
        self.output.unlink()
        self.refuse(1, 'remove', '--map', self.both, '--session', 'rainy',
                    words=(f'{self.both}: has no session', "'campus_sunny_1', 'campus_cloudy_1'"))
        self.refuse(1, 'remove', '--map', MAP, '--session', 'campus_sunny_1', words=('no image would be left',))

    def test_what_is_cut_is_inside_the_polygon(self):
        rows = self.images(MAP)
        middle = sorted(float(row['longitude_deg']) for row in rows)[len(rows) // 2]
        ring = [[middle, -80], [170, -80], [170, 80], [middle, 80], [middle, -80]]
        polygon = self.folder / 'east.geojson'
        polygon.write_text(json.dumps({'type': 'Polygon', 'coordinates': [ring]}), encoding='utf-8')
        self.edit('cut', '--map', MAP, '--polygon', polygon)
        self.assertEqual(self.images(self.output), [row for row in rows if float(row['longitude_deg']) >= middle])
        self.output.unlink()
        polygon.write_text('{"type": "Point", "coordinates": [1, 2]}', encoding='utf-8')
        self.refuse(1, 'cut', '--map', MAP, '--polygon', polygon, words=(f'{polygon}: has no Polygon',))
        self.refuse(1, 'cut', '--map', MAP, '--polygon', self.folder / 'none', words=('none: ',))
        polygon.write_text(json.dumps({'type': 'Polygon', 'coordinates': [[[0, 0], [1, 0], [1, 1], [0, 0]]]}),
                           encoding='utf-8')
        self.refuse(1, 'cut', '--map', MAP, '--polygon', polygon, words=(f'{MAP}: no image would be left',))

    def test_what_is_cut_is_inside_the_box_in_metres(self):
        rows = self.images(MAP)
        middle, top = (sorted(float(row[axis]) for row in rows)[len(rows) // 2] for axis in ('east_m', 'north_m'))
        expected = [row for row in rows if float(row['east_m']) >= middle and float(row['north_m']) <= top]
        self.assertGreater(len(expected), 10)
        self.edit('cut', '--map', MAP, '--box', middle, -1000, 1000, top)
        self.assertEqual(self.images(self.output), expected)
        self.output.unlink()
        polygon = self.folder / 'box.geojson'
        ring = [[middle, -1000], [1000, -1000], [1000, top], [middle, top], [middle, -1000]]
        polygon.write_text(json.dumps({'type': 'Polygon', 'coordinates': [ring]}), encoding='utf-8')
        self.edit('cut', '--map', MAP, '--polygon', polygon, '--metres')
        self.assertEqual(self.images(self.output), expected)
        self.output.unlink()
        self.refuse(2, 'cut', '--map', MAP, '--box', 10, 0, -10, 5, words=('--box: must be WEST SOUTH EAST NORTH',))
        self.refuse(2, 'cut', '--map', MAP, '--box', 1, 2, 3, words=('--box',))
        self.refuse(2, 'cut', '--map', MAP, '--box', 0, 0, 1, 1, '--polygon', polygon, words=('--polygon',))
        self.refuse(2, 'cut', '--map', MAP, '--box', 0, 0, 1, 1, '--metres', words=('--metres',))
        self.refuse(2, 'cut', '--map', MAP, words=('--polygon', '--box'))

    def test_a_thinned_map_has_the_spacing(self):
        self.edit('thin', '--map', MAP, '--spacing', 10)
        rows = self.images(self.output)
        points = [(float(row['east_m']), float(row['north_m'])) for row in rows]
        self.assertGreater(len(points), 10)
        for here, there in zip(points, points[1:]):
            self.assertGreaterEqual(math.dist(here, there), 10)
        self.refuse(2, 'thin', '--map', MAP, '--spacing', -1, words=('--spacing',))

    def test_a_summary_keeps_what_was_used(self):
        with open(self.used, newline='', encoding='utf-8') as file:
            used = {int(row['stamp_ns']): int(row['poses']) for row in csv.DictReader(file)}
        self.assertGreater(sum(used.values()), 380)
        self.edit('summarise', '--map', self.both, '--usage', self.used, '--per-place', 2)
        before, rows = self.images(self.both), self.images(self.output)
        self.assertLess(len(rows), .9 * len(before))
        self.assertEqual({row['session'] for row in rows}, {row['session'] for row in before})
        # What was used most stays, and the drive goes as well as before.
        most = sorted(used, key=used.get)[-20:]
        kept = {round(float(row['stamp']) * 10) for row in rows}
        self.assertGreaterEqual(sum(round(stamp / 1e8) in kept for stamp in most), 18)
        result = run('localize', '--map', self.output, '--bag', CLOUDY, '--output', self.folder / 'track.csv',
                     '--truth-topic', '/ground_truth/fix')
        self.assertLess(float(result.stdout.split('mean ')[1].split(' m')[0]), .3, result.stdout)
        self.output.unlink()
        (self.folder / 'track.csv').write_text('stamp\n1\n', encoding='utf-8')
        self.refuse(1, 'summarise', '--map', self.both, '--usage', self.folder / 'track.csv',
                    words=('track.csv: line 1: must be',))

    def test_a_drive_extends_the_map_without_fixes(self):
        track = self.folder / 'track.csv'
        result = run('localize', '--map', MAP, '--bag', CLOUDY, '--output', track, '--extend', self.output)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(run('map_info', '--check', self.output).returncode, 0)
        rows = self.images(self.output)
        self.assertEqual({row['session'] for row in rows}, {'campus_sunny_1', 'campus_cloudy_1'})
        with open(track, newline='', encoding='utf-8') as file:
            verified = {row['stamp'] for row in csv.DictReader(file) if row['source'] == 'METRIC'}
        added = [row for row in rows if row['session'] == 'campus_cloudy_1']
        self.assertGreater(len(added), 50)
        self.assertLessEqual({row['stamp'] for row in added}, verified)
        self.assertIn('edited:      extension of campus_sunny_1.map, campus_cloudy_1.bag by localize',
                      run('map_info', self.output).stdout)

        command = [sys.executable, MAP_ERROR, '--map', self.output, '--bag', SUNNY, '--bag', CLOUDY, '--programs',
                   PROGRAMS]
        errors = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stdout
        of_sunny, of_cloudy = (float(value) for value in re.findall(r'images, error mean ([\d.]+)', errors))
        self.assertLess(of_cloudy, of_sunny + .05, errors)
        self.assertLess(float(re.search(r'apart mean ([\d.]+)', errors).group(1)), .1, errors)

    def test_the_drive_that_made_the_map_does_not_extend_it(self):
        before = sorted(self.folder.iterdir())
        result = run('localize', '--map', MAP, '--bag', SUNNY, '--output', self.folder / 'track.csv', '--extend',
                     self.output)
        self.assert_refused(result, 1, 'localize: ', f"{SUNNY}: is in {MAP} already, as session 'campus_sunny_1'")
        self.assertEqual(sorted(self.folder.iterdir()), before)

    def test_an_extension_that_makes_no_sense_is_refused(self):
        places = self.folder / 'places.map'
        options = self.folder / 'places.yaml'
        options.write_text('geometry: {enabled: false}\n', encoding='utf-8')
        self.assertEqual(run('map_builder', '--bag', SUNNY, '--config', options, '--output', places).returncode, 0)
        for code, map_file, arguments, words in (
                (2, MAP, ['--start-index', 5, '--extend', self.output], ('--extend', '--start-index')),
                (2, MAP, ['--extend', MAP], ('--extend', str(MAP))),
                (1, MAP, ['--extend', '/absent/new.map'], ('/absent/new.map',)),
                (2, MAP, ['--pose-source', 'place', '--extend', self.output], ('--pose-source',)),
                (1, places, ['--extend', self.output], (f'--extend: {places} has no landmarks',))):
            with self.subTest(arguments=arguments):
                result = run('localize', '--map', map_file, '--bag', CLOUDY, '--output', self.folder / 'track.csv',
                             *arguments)
                self.assert_refused(result, code, 'localize: ', *words)
                self.assertFalse(self.output.exists())

    def test_bad_usage_is_refused(self):
        self.refuse(2, words=('subcommand',))
        self.refuse(2, 'shrink', words=())
        self.refuse(2, 'merge', MAP, words=('maps',))
        self.refuse(2, 'merge', MAP, MAP, words=('is the same file as',))
        self.refuse(2, 'thin', '--map', MAP, words=('--spacing',))
        self.refuse(2, 'add', '--map', MAP, '--bag', CLOUDY, '--bag', CLOUDY, words=('is the same file',))
        copy = self.folder / 'new.map'
        shutil.copy(MAP, copy)
        self.refuse(2, 'thin', '--map', copy, '--spacing', 5, words=('would overwrite',))
        self.assertEqual(copy.read_bytes(), MAP.read_bytes())

    def test_maps_that_cannot_be_one_are_refused(self):
        copy = self.folder / 'copy.map'
        shutil.copy(MAP, copy)
        self.refuse(1, 'merge', MAP, copy, words=("its session 'campus_sunny_1' is in", 'the same times'))
        said = self.refuse(1, 'add', '--map', MAP, '--bag', SUNNY,
                           words=(f"{SUNNY}: is in {MAP} already, as session 'campus_sunny_1' (the same times)",))
        self.assertEqual(said, '')  # before the work
        self.refuse(1, 'merge', MAP, self.folder / 'absent.map', words=('absent.map: ',))
        damaged = self.folder / 'damaged.map'
        damaged.write_bytes(MAP.read_bytes()[:-5000])
        self.refuse(1, 'merge', MAP, damaged, words=('damaged.map: ',))
        newer = self.folder / 'newer.map'
        shutil.copy(MAP, newer)
        with sqlite3.connect(newer) as database:
            database.execute('PRAGMA user_version = 99')
        self.refuse(1, 'merge', MAP, newer, words=('newer.map', 'version 99'))
        self.refuse(1, 'merge', MAP, SUNNY, words=('campus_sunny_1.bag: is not a map',))

    def test_a_full_disk_is_one_line_and_leaves_nothing(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

        self.refuse(1, 'thin', '--map', MAP, '--spacing', 3, words=('new.map: ',), preexec_fn=small_files)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
