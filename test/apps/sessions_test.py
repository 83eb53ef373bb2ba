"""Several sessions in one map, as a user meets them: map_builder, its plot, and what map_info tells."""
import csv
import json
import os
import re
import shutil
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from program_runner import PROGRAMS, ProgramTest, run

SUNNY, CLOUDY = (Path(argument) for argument in sys.argv[2:4])
SVG = '{http://www.w3.org/2000/svg}'


def texts_of(plot: Path) -> list:
    """The texts of a plot: matplotlib draws letters as shapes and notes what they say in a comment."""
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    return [comment.text.strip() for comment in ElementTree.parse(plot, parser).getroot().iter(ElementTree.Comment)]


def marks_of(plot: Path, name: str) -> list:
    """How many marks each group has whose name begins like this."""
    groups = ElementTree.parse(plot).getroot().iter(SVG + 'g')
    return [len(list(group.iter(SVG + 'use'))) for group in groups if group.get('id', '').startswith(name)]


class SessionsTest(ProgramTest):
    """A map of a sunny and a cloudy session."""
    both = None  # folder of the map of all images and what the builder said; made by the first test that asks for it

    def build(self, *bags, **options) -> str:
        """Makes `self.map` and `self.plot`; what the builder says."""
        self.map, self.plot = self.folder / 'both.map', self.folder / options.get('plot', 'both.svg')
        arguments = [word for bag in bags for word in ('--bag', bag)]
        result = run('map_builder', *arguments, '--output', self.map, '--plot', self.plot, '--spacing', 0,
                     '--min-spacing', options.get('spacing', 1.2))
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def use_both(self) -> str:
        """The same for both sessions, image by image: built once, so it must stay as it is."""
        if not SessionsTest.both:
            own, folder = self.folder, tempfile.TemporaryDirectory()
            self.folder = Path(folder.name)
            SessionsTest.addClassCleanup(folder.cleanup)
            SessionsTest.both = self.folder, self.build(SUNNY, CLOUDY)
            self.folder = own
        folder, said = SessionsTest.both
        self.map, self.plot = folder / 'both.map', folder / 'both.svg'
        return said

    def info(self, *arguments) -> str:
        result = run('map_info', self.map, *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_two_recordings_become_sessions(self):
        said = self.use_both()
        kept = [int(number) for number in re.findall(r'^campus_\w+: (\d+) images of 320x240 px$', said, re.M)]
        self.assertEqual(len(kept), 2, said)
        self.assertIn(f'images: {sum(kept)} kept', said)
        shown = self.info('--check', '--ambiguity')
        self.assertRegex(shown, rf'0  campus_sunny_1 +{kept[0]} images +\d+ m +\d+ % shared with others   '
                         r'\d{4}-\d\d-\d\d \d\d:\d\d:\d\d to')
        self.assertRegex(shown, rf'1  campus_cloudy_1 +{kept[1]} images')
        route, driven = (float(number) for number in re.search(r'route (\d+) m.*; (\d+) m driven', shown).groups())
        self.assertAlmostEqual(driven, 2 * route, delta=0.1 * driven)
        shared = float(re.search(r'\((\d+) %\) seen by more than one session', shown).group(1))
        self.assertGreater(shared, 95)
        self.assertIn('(100 %) driven in one direction only', shown)
        for heading in ('headings:', 'weak:', 'density:', 'coverage:'):
            self.assertIn('\n' + heading, shown)
        self.assertRegex(shown, rf'ambiguous: +\d+ of {sum(kept)} images')
        self.assertIn('check:       ok', shown)

    def test_the_exports_carry_session_and_weakness(self):
        self.use_both()
        table, geojson = self.folder / 'map.csv', self.folder / 'map.geojson'
        self.info('--export-csv', table)
        with open(table, newline='', encoding='utf-8') as file:
            features = sorted(int(row['features']) for row in csv.DictReader(file))
        few = features[len(features) // 10] + 1
        self.info('--few-features', few, '--ambiguity', '--export-csv', table, '--export-geojson', geojson)
        with open(table, newline='', encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual({row['session'] for row in rows}, {'campus_sunny_1', 'campus_cloudy_1'})
        for row in rows:
            self.assertEqual(row['weak'], '1' if int(row['features']) < few else '0')
            self.assertIn(row['ambiguous'], ('0', '1'))
        weak = [row for row in rows if row['weak'] == '1']
        self.assertGreater(len(weak), 0)
        features = json.loads(geojson.read_text(encoding='utf-8'))['features']
        stretches = [one for one in features if one['properties'].get('weak') == 'few features']
        self.assertEqual(sum(one['properties']['images'] for one in stretches), len(weak))
        for one in stretches:
            points = one['geometry']['coordinates']
            self.assertEqual(len(points), max(2, one['properties']['images']))
            self.assertLess(one['properties']['least_features'], few)
        self.info('--export-csv', table)
        with open(table, newline='', encoding='utf-8') as file:
            self.assertEqual({row['ambiguous'] for row in csv.DictReader(file)}, {''})

    def test_the_plot_names_each_reason_with_its_count(self):
        said = self.use_both()
        texts = texts_of(self.plot)
        for name in ('campus_sunny_1', 'campus_cloudy_1'):
            self.assertEqual(texts.count(name), 2)
            fixes = re.search(rf'^{name}: (\d+) fixes: (\d+) kept, (\d+) no fix, (\d+) out of order, (\d+) spike, '
                              r'(\d+) multipath', said, re.M).groups()
            for count, meaning in zip(fixes, (' fixes', ' kept', ' no fix', ' out of order', ' spike', ' multipath')):
                self.assertTrue(any(text.startswith(count + meaning) for text in texts), (count + meaning, texts))
        self.assertIn('all sessions, cleaned paths', texts)
        self.assertEqual(texts.count('N'), 3)
        self.assertEqual(texts.count('20 m'), 3)
        self.assertNotIn('nan', self.plot.read_text(encoding='utf-8'))
        for reason, count in (('spike', r'(\d+) spike'), ('multipath', r'(\d+) multipath'), ('kept', r'(\d+) kept, ')):
            self.assertEqual(marks_of(self.plot, reason + '_'), [int(n) for n in re.findall(count, said)][:2])
        self.assertEqual([sum(marks_of(self.plot, 'images_'))],
                         [int(n) for n in re.findall(r'^images: (\d+) kept', said, re.M)])
        self.assertEqual(sorted(path.name for path in self.map.parent.iterdir()), ['both.map', 'both.svg'])

    def test_the_ending_of_the_plot_decides_its_format(self):
        for ending, begin in (('.png', b'\x89PNG'), ('.pdf', b'%PDF'), ('.SVG', b'<?xml')):
            with self.subTest(ending=ending):
                self.build(SUNNY, spacing=10, plot='plot' + ending)
                self.assertEqual(self.plot.read_bytes()[:len(begin)], begin)

    def test_a_plot_that_fails_is_one_line_and_leaves_the_map_and_the_old_plot(self):
        output, plot, copy = self.folder / 'a.map', self.folder / 'plot.png', self.folder / 'bin'
        plot.write_text('the old one', encoding='utf-8')
        copy.mkdir()
        program, script = Path(shutil.copy(PROGRAMS / 'map_builder', copy)), copy / 'plot_map.py'
        for content, reason in (('', 'is missing'),
                                ('#!/absent/python3\n', 'is Python 3 installed?'),
                                ('#!/bin/sh\necho one >&2\necho "plot_map: no ink" >&2\nexit 1\n',
                                 'failed: plot_map: no ink'),
                                ('#!/bin/sh\nexit 3\n', 'failed: without a message')):
            with self.subTest(reason=reason):
                if content:
                    script.write_text(content, encoding='utf-8')
                    script.chmod(0o755)
                output.unlink(missing_ok=True)
                self.assert_refused(run(program, '--bag', SUNNY, '--min-spacing', 10, '--output', output,
                                        '--plot', plot), 1, 'plot_map.py', reason, 'the map is written', str(output))
                self.assertEqual(run('map_info', output, '--check').returncode, 0)
                self.assertEqual(plot.read_text(encoding='utf-8'), 'the old one')
                self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ['a.map', 'bin', 'plot.png'])

    def test_without_matplotlib_the_plot_says_what_to_install(self):
        (self.folder / 'matplotlib.py').write_text('raise ImportError("No module named matplotlib")', encoding='utf-8')
        result = run('map_builder', '--bag', SUNNY, '--min-spacing', 10, '--output', self.folder / 'a.map',
                     '--plot', self.folder / 'plot.png', env={**os.environ, 'PYTHONPATH': str(self.folder)})
        self.assert_refused(result, 1, 'matplotlib', 'install python3-matplotlib', 'the map is written')
        self.assertIn('images: ', result.stdout)

    def test_a_recording_given_twice_is_refused(self):
        output = self.folder / 'twice.map'
        result = run('map_builder', '--bag', SUNNY, '--bag', SUNNY.parent / '.' / SUNNY.name, '--output', output)
        self.assert_refused(result, 2, 'is the same file')
        self.assertFalse(output.exists())

    def test_a_copy_gets_a_name_of_its_own(self):
        copy = self.folder / SUNNY.name
        shutil.copy(SUNNY, copy)
        self.build(SUNNY, copy, spacing=10)
        self.assertIn('campus_sunny_1_2', self.info())

    def test_a_recording_without_fixes_is_named(self):
        broken = self.folder / 'broken.bag'
        broken.write_bytes(CLOUDY.read_bytes().replace(b'/gps/fix', b'/gps/nix'))
        result = run('map_builder', '--bag', SUNNY, '--bag', broken, '--output', self.folder / 'out.map',
                     '--min-spacing', 10)
        self.assert_refused(result, 1, 'broken.bag', '/gps/fix')
        self.assertFalse((self.folder / 'out.map').exists())

    def test_whatever_a_session_is_called_it_stays_in_its_line(self):
        copy = self.folder / ('x\n\x1b[31mcheck: ok' + 'y' * 200 + '.bag')
        shutil.copy(CLOUDY, copy)
        self.build(SUNNY, spacing=10)
        self.assertNotIn('all sessions, cleaned paths', texts_of(self.plot))
        self.build(SUNNY, CLOUDY, spacing=10)
        lines = len(self.info().splitlines())
        self.build(SUNNY, copy, spacing=10)
        shown = self.info()
        self.assertNotIn('\x1b', shown)
        self.assertEqual(len(shown.splitlines()), lines)
        self.assertLess(max(len(line) for line in shown.splitlines()), 180)
        ElementTree.parse(self.plot)

    def test_names_may_have_letters_of_any_language(self):
        # Longer than any place for them, so that they are cut.
        copy = self.folder / ('x' + '\u00e4' * 60 + '.bag')
        shutil.copy(CLOUDY, copy)
        self.build(SUNNY, copy, spacing=10)
        texts = texts_of(self.plot)
        self.assertEqual(len([text for text in texts if re.fullmatch('\\.\\.\\.\u00e4+', text)]), 2, texts)
        self.assertRegex(self.info(), r'1  x\u00e4+ +\d+ images')

    def test_a_map_without_near_neighbours_is_not_called_ambiguous(self):
        self.build(SUNNY, spacing=6)
        shown = self.info('--ambiguity')
        images = int(re.search(r'images: +(\d+) of', shown).group(1))
        ambiguous, judged = map(int, re.search(r'ambiguous: +(\d+) of (\d+) images', shown).groups())
        alone = int(re.search(r'(\d+) images have no neighbour within 5 m and cannot be judged', shown).group(1))
        self.assertEqual(ambiguous, 0)
        self.assertEqual(judged + alone, images)
        self.assertGreater(alone, 30)  # two are near where the session begins and ends

    def test_a_map_is_described_in_a_few_dozen_lines(self):
        self.use_both()
        shown = self.info()
        self.assertLess(len(shown.splitlines()), 60)
        self.assertLess(max(len(line) for line in shown.splitlines()), 160)


if __name__ == '__main__':
    os.environ.pop('ROS_MASTER_URI', None)
    unittest.main(argv=sys.argv[:1], verbosity=2)
