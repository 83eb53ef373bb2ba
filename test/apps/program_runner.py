"""Runs the programs of the folder that the command line names first."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rosbag

PROGRAMS = Path(sys.argv[1]).resolve()
TIMEOUT_S = 200 * int(os.environ.get('VISUAL_LOCALIZATION_TEST_SLOWNESS', '1'))  # of a program in this build


def run(program: str, *arguments, **options) -> subprocess.CompletedProcess:
    command = [str(PROGRAMS / program), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False, **options)


def first_images(bag: Path, count: int, part: Path) -> Path:
    """Writes what a bag has up to so many images, as `part`."""
    with rosbag.Bag(str(bag)) as whole, rosbag.Bag(str(part), 'w') as first:
        for topic, message, stamp in whole.read_messages(raw=True):
            count -= topic.endswith('/compressed')
            if count < 0:
                break
            first.write(topic, message, stamp, raw=True)
    return part


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def assert_refused(self, result: subprocess.CompletedProcess, code: int, *words: str):
        """One line on standard error that holds these words."""
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
