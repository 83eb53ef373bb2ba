"""build_large_map.sh: a map of many bags, a job at a time, that goes on where it was cut short."""
import subprocess
import sys
import unittest
from pathlib import Path

from program_runner import PROGRAMS, ProgramTest, run

SCRIPT, SUNNY, CLOUDY = (Path(argument) for argument in sys.argv[2:5])


class BuildLargeMapTest(ProgramTest):
    """Of both sample recordings, as places."""

    def build(self, *arguments) -> subprocess.CompletedProcess:
        """Runs the script in a folder of its own."""
        config = self.folder / 'places.yaml'
        config.write_text('geometry: {enabled: false}\n', encoding='utf-8')
        command = [SCRIPT, '--output', self.folder / 'all.map', '--work', self.folder / 'work', '--programs', PROGRAMS,
                   '--builder-options', f'--config {config} --min-spacing 5', *arguments]
        return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=200, check=False)

    def shards(self) -> dict:
        """The time of each map of a bag."""
        return {path.name.split('_')[1]: path.stat().st_mtime_ns for path in self.folder.glob('work/shards/*.map')}

    def test_names_what_fails_and_goes_on_where_it_was(self):
        bad = self.folder / 'bad.bag'
        bad.write_text('no bag\n', encoding='utf-8')
        result = self.build(SUNNY, bad, CLOUDY)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r'failed: .*/bad_\w+\.map: map_builder: .*bad\.bag: is not a bag')
        self.assertFalse((self.folder / 'all.map').exists())
        before = self.shards()
        self.assertEqual(len(before), 2)
        result = self.build(CLOUDY, SUNNY)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('maps of bags: 2, to be built: 0', result.stdout)
        self.assertEqual(before, self.shards())
        shown = run('map_info', '--check', self.folder / 'all.map').stdout
        self.assertIn('0  campus_sunny_1', shown)
        self.assertIn('1  campus_cloudy_1', shown)

    def test_leaves_out_what_fails_when_it_may(self):
        bad = self.folder / 'bad.bag'
        bad.write_text('no bag\n', encoding='utf-8')
        result = self.build('--allow-failures', SUNNY, bad)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('bad.bag: is not a bag', result.stderr)
        self.assertIn('all.map: of 1 of 2 bags', result.stdout)
        self.assertEqual(run('map_info', '--check', self.folder / 'all.map').returncode, 0)

    def test_refuses_bad_usage(self):
        for arguments in ((), ('--runner', 'ssh', SUNNY), ('--jobs', '0', SUNNY), ('--what', SUNNY)):
            self.assertEqual(self.build(*arguments).returncode, 2, arguments)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
