"""The installed package as another package's author meets it: find_package, the examples, what lies beside them."""
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rosbag

BUILD, PREFIX, BAG, CXX_FLAGS = Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4]
SHARE = PREFIX / 'share/visual_localization'
PROGRAMS = PREFIX / 'lib/visual_localization'


def run(*command, **options) -> subprocess.CompletedProcess:
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=500, check=False, **options)


class InstallTest(unittest.TestCase):
    """One installation and one build of the examples for all tests."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.examples = Path(cls.folder.name) / 'examples'
        for command in (['cmake', '--install', BUILD],
                        ['cmake', '-S', SHARE / 'examples', '-B', cls.examples, f'-DCMAKE_PREFIX_PATH={PREFIX}',
                         '-DCMAKE_BUILD_TYPE=Release', f'-DCMAKE_CXX_FLAGS={CXX_FLAGS}'],
                        ['cmake', '--build', cls.examples]):
            result = run(*command)
            assert result.returncode == 0, result.stdout + result.stderr

    def write_images(self, folder: Path, every: int) -> Path:
        """Images of the bag as files, and their list with exact positions."""
        fixes = {}
        images = []
        with rosbag.Bag(str(BAG)) as bag:
            for topic, message, _ in bag.read_messages(['/ground_truth/fix', '/stereo/left/image_raw/compressed']):
                if topic == '/ground_truth/fix':
                    fixes[message.header.stamp.to_nsec()] = message
                else:
                    images.append(message)
        lines = []
        for message in images[:80:every]:
            stamp_ns = message.header.stamp.to_nsec()
            path = folder / f'{stamp_ns}.jpg'
            path.write_bytes(bytes(message.data))
            lines.append(f'{stamp_ns / 1e9:.6f} {fixes[stamp_ns].latitude:.9f} {fixes[stamp_ns].longitude:.9f} {path}')
        (folder / 'list.txt').write_text('\n'.join(lines) + '\n')
        return folder / 'list.txt'

    def test_the_examples_build_a_map_and_localise_in_it(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            images = self.write_images(folder, 1)
            built = run(self.examples / 'build_map', images, folder / 'example.map')
            self.assertEqual(built.returncode, 0, built.stderr)
            self.assertGreater(int(re.search(r': (\d+) images', built.stdout).group(1)), 60)
            paths = [line.split()[3] for line in images.read_text().splitlines()][20:45]
            localised = run(self.examples / 'localize_image', folder / 'example.map', *paths)
            self.assertEqual(localised.returncode, 0, localised.stderr)
            lines = localised.stdout.splitlines()
            self.assertEqual(len(lines), len(paths))
            self.assertIn('TRACKING', lines[-1])

    def test_the_examples_refuse_what_they_cannot_read(self):
        for program, arguments in (('build_map', ['/nowhere.txt', '/tmp/never.map']),
                                   ('localize_image', ['/nowhere.map', '/nowhere.jpg'])):
            result = run(self.examples / program, *arguments)
            self.assertEqual(result.returncode, 1)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)

    def test_an_example_is_at_most_sixty_lines(self):
        for path in (SHARE / 'examples').glob('*.cpp'):
            self.assertLessEqual(len(path.read_text().splitlines()), 60, path)

    def test_installed_headers_include_nothing_that_is_not_installed(self):
        include = PREFIX / 'include'
        headers = sorted(include.rglob('*.h'))
        self.assertGreater(len(headers), 20)
        for path in headers:
            for header in re.findall(r'#include "([^"]+)"', path.read_text()):
                self.assertTrue((include / header).is_file(), f'{path}: {header}')

    def test_the_sample_experiment_finds_its_bags(self):
        experiment = SHARE / 'config/evaluation/sample.yaml'
        bags = re.findall(r'bag: ([^,]+),', experiment.read_text())
        self.assertEqual(len(bags), 2)
        for bag in bags:
            self.assertTrue((experiment.parent / bag).resolve().is_file(), bag)

    def test_programs_and_scripts_run_where_they_are_installed(self):
        names = sorted(path.name for path in PROGRAMS.iterdir() if path.is_file())
        for name in ('map_builder', 'map_edit', 'map_info', 'localize', 'evaluate', 'localizer_node', 'plot_map.py',
                     'plot_status.py', 'record_track.py', 'report_track.py', 'report_evaluation.py'):
            self.assertIn(name, names)
            result = run('bash', '-c', f'source {PREFIX}/setup.bash && exec {PROGRAMS / name} --help')
            self.assertEqual(result.returncode, 0, name + ': ' + result.stderr)

    def test_roslaunch_finds_each_launch_file_of_the_checkout_once(self):
        """It looks into all folders of a package but the hidden ones."""
        checkout = Path(__file__).resolve().parents[2]
        for path in sorted((checkout / 'launch').glob('*.launch')):
            find = f'import roslib.packages as p; print(p.find_resource("visual_localization", "{path.name}"))'
            result = run(sys.executable, '-c', find, env={'PATH': '/usr/bin:/bin', 'ROS_PACKAGE_PATH': str(checkout)})
            self.assertEqual(result.stdout.strip(), str([str(path)]), result.stderr)

    def test_programs_run_without_setup(self):
        for name in ('map_builder', 'map_edit', 'map_info', 'localize', 'evaluate', 'localizer_node', 'map_recorder'):
            result = run(PROGRAMS / name, '--help', env={'PATH': '/usr/bin:/bin'})
            self.assertEqual(result.returncode, 0, name + ': ' + result.stderr)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
