"""Scripts that delete folders delete only what they made, and root runs nothing that another user may have put there:
bare_tree.sh, with a debootstrap that makes next to nothing, install_from_source.sh and compare_tracks.py."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPTS = Path(sys.argv[1]).resolve()
sys.path.insert(0, str(SCRIPTS))

DEBOOTSTRAP = """#!/bin/sh
for tree; do :; done
eval tree=\\${$(($# - 1))}
test -e "$tree/.visual_localization_tree" || exit 1
mkdir -p "$tree/etc" "$tree/usr/sbin" "$tree/root"
touch "$tree/etc/of_debian"
ln -s "$tree/../outside" "$tree/etc/hosts"
"""


class BareTreeTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.tree = self.folder / 'tree'
        programs = self.folder / 'bin'
        programs.mkdir()
        (programs / 'debootstrap').write_text(DEBOOTSTRAP, encoding='utf-8')
        (programs / 'debootstrap').chmod(0o755)
        self.path = f'{programs}:{os.environ["PATH"]}'

    def run_shell(self, commands: str) -> subprocess.CompletedProcess:
        """With the functions of bare_tree.sh, on the tree of this test."""
        script = f"""set -euo pipefail
source "{SCRIPTS}/build_progress.sh"
source "{SCRIPTS}/bare_tree.sh"
tree={self.tree} release=bookworm mirror=nowhere
{commands}"""
        return subprocess.run(['bash', '-c', script, 'trial.sh'], env={**os.environ, 'PATH': self.path},
                              capture_output=True, text=True, timeout=60, check=False)

    def refuse(self, commands: str) -> None:
        """Refuses, names the folder, and leaves everything as it is."""
        before = sorted(self.folder.rglob('*'))
        result = self.run_shell(commands)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, rf'^trial: {self.tree} is no tree of this script')
        self.assertEqual(sorted(self.folder.rglob('*')), before)

    def test_a_tree_is_made_used_again_made_anew_and_removed(self):
        for commands in ('make_tree; is_tree', 'is_tree', 'make_tree; is_tree', 'remove_tree; [[ ! -e $tree ]]',
                         'remove_tree'):
            result = self.run_shell(commands)
            self.assertEqual(result.returncode, 0, f'{commands}: {result.stderr}')
        self.assertFalse((self.folder / 'outside').exists(), 'a link was followed out of the tree')

    def test_what_was_not_made_here_is_refused(self):
        (self.tree / 'root').mkdir(parents=True)
        (self.tree / 'root' / '.is_whole').touch()
        self.assertEqual(self.run_shell('is_tree').returncode, 1)
        for commands in ('make_tree', 'remove_tree', 'require_own_tree'):
            self.refuse(commands)

    def test_a_link_to_a_tree_and_a_file_are_refused(self):
        self.assertEqual(self.run_shell('make_tree').returncode, 0)
        self.tree.rename(self.folder / 'elsewhere')
        self.tree.symlink_to(self.folder / 'elsewhere')
        self.refuse('make_tree')
        self.tree.unlink()
        self.tree.touch()
        self.refuse('remove_tree')

    def test_a_tree_that_was_begun_is_ours(self):
        self.tree.mkdir(mode=0o755)
        (self.tree / '.visual_localization_tree').touch(mode=0o644)
        (self.tree / 'half').mkdir()
        result = self.run_shell('make_tree; is_tree')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertFalse((self.tree / 'half').exists())

    def test_an_empty_folder_is_taken(self):
        self.tree.mkdir(mode=0o755)
        self.assertEqual(self.run_shell('make_tree; is_tree').returncode, 0)

    def test_what_another_user_may_write_is_refused(self):
        self.tree.mkdir(mode=0o755)
        self.tree.chmod(0o777)
        self.refuse('make_tree')
        self.tree.chmod(0o755)
        self.assertEqual(self.run_shell('make_tree; is_tree').returncode, 0)
        marker = self.tree / '.visual_localization_tree'
        for path in (self.tree, marker):
            mode = path.stat().st_mode
            path.chmod(mode | 0o020)
            self.assertEqual(self.run_shell('is_tree').returncode, 1, path)
            self.refuse('remove_tree')
            path.chmod(mode)
        if os.geteuid() != 0:
            return  # nobody else can own a tree
        for path in (self.tree, marker):
            os.chown(path, 65534, 65534)
            self.refuse('require_own_tree')
            os.chown(path, 0, 0)
        self.assertEqual(self.run_shell('is_tree').returncode, 0)


class InstallFromSourceTest(unittest.TestCase):
    """What it builds stays in a folder of its own."""

    def test_what_is_no_plain_name_is_refused(self):
        with tempfile.TemporaryDirectory() as name:
            (Path(name) / 'CMakeLists.txt').write_text('message(FATAL_ERROR ran)', encoding='utf-8')
            (Path(name) / 'below').mkdir()
            for source in ('..', '.', '../.', '/', f'{name}/below/..'):
                result = subprocess.run([SCRIPTS / 'install_from_source.sh', '--prefix', name, source], text=True,
                                        cwd=Path(name) / 'below', capture_output=True, timeout=60, check=False)
                self.assertEqual(result.returncode, 1, source)
                self.assertRegex(result.stderr, f"^install_from_source: '{source}' does not end with a plain name")


class CompareTracksTest(unittest.TestCase):
    """The folder that keeps what a build made."""

    def test_a_folder_that_it_did_not_make_stays(self):
        try:
            import compare_tracks
        except ImportError as error:
            self.skipTest(str(error))
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for program in ('localize', 'map_builder'):
                path = folder / 'build' / 'lib' / 'visual_localization' / program
                path.parent.mkdir(parents=True, exist_ok=True)
                path.touch()
            work = folder / 'work'
            build = compare_tracks.Build(folder / 'build', work)
            (build.folder / 'a.map').touch()
            (build.folder / 'build.txt').write_text('another build', encoding='utf-8')
            self.assertFalse((compare_tracks.Build(folder / 'build', work).folder / 'a.map').exists())
            (build.folder / 'build.txt').unlink()
            (build.folder / 'mine.txt').touch()
            with self.assertRaisesRegex(compare_tracks.Failure, 'was not made by compare_tracks'):
                compare_tracks.Build(folder / 'build', work)
            self.assertTrue((build.folder / 'mine.txt').exists())


if __name__ == '__main__':
    del sys.argv[1:]
    unittest.main()
