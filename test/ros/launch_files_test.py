#!/usr/bin/env python3
"""Every launch file can be read with its arguments, and build_map.launch builds maps and ends."""
import itertools
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import unittest

import rosbag

import localizer_fixture as fixture

BAG, OTHER_BAG = sys.argv[1:3]
LAUNCH = pathlib.Path(__file__).resolve().parents[2] / 'launch'
CONFIGURATIONS = {
    'atrv_jr.launch': [[], ['mode:=record'], ['rectify:=true', 'rviz:=false']],
    'build_map.launch': [['bag:=/a.bag', 'output:=/a.map']],
    'localizer.launch': [[], ['map:=/a.map', 'preset:=paper', 'tracker:=pf_linear', 'odom:=/wheels'], ['manager:=nodelets']],
    'map_recorder.launch': [[], ['folder:=/data', 'map:=/a.map', 'rviz:=true']],
    'replay.launch': [['bag:=/a.bag', 'map:=/a.map'], ['bag:=/a.bag', 'map:=/a.map', 'plot_output:=/a.png']],
    'robot_template.launch': [[], ['mode:=record'], ['odom:=/odom']],
}


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def roslaunch(*arguments, timeout_s=400 * fixture.SLOWNESS):
    return subprocess.run(['roslaunch', *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True, timeout=timeout_s)


class LaunchFilesTest(unittest.TestCase):
    def build(self, folder, *arguments):
        """What build_map.launch prints with a master of its own."""
        port = free_port()
        os.environ['ROS_MASTER_URI'] = 'http://127.0.0.1:%d' % port
        return roslaunch('-p', str(port), str(LAUNCH / 'build_map.launch'),
                         'output:=%s/round.map' % folder, *arguments)

    def test_every_launch_file_is_tried(self):
        self.assertEqual(sorted(CONFIGURATIONS), sorted(path.name for path in LAUNCH.glob('*.launch')))

    def test_every_launch_file_can_be_read(self):
        for name, configurations in CONFIGURATIONS.items():
            for arguments in configurations:
                with self.subTest(name=name, arguments=arguments):
                    read = roslaunch('--nodes', str(LAUNCH / name), *arguments)
                    self.assertEqual(read.returncode, 0, read.stdout)
                    self.assertIn('/', read.stdout)

    def test_a_replayed_bag_does_not_broadcast(self):
        """Its odom to base_link would be a second parent."""
        read = roslaunch('--args', 'player', str(LAUNCH / 'replay.launch'), 'bag:=/a.bag', 'map:=/a.map')
        self.assertIn('/tf:=/recorded/tf', read.stdout)

    def test_an_unknown_mode_is_refused(self):
        for name in ('atrv_jr.launch', 'robot_template.launch'):
            read = roslaunch('--nodes', str(LAUNCH / name), 'mode:=locate')
            self.assertNotEqual(read.returncode, 0)
            self.assertIn('locate', read.stdout)

    def test_several_bags_become_sessions_of_one_map(self):
        with tempfile.TemporaryDirectory() as folder:
            run = self.build(folder, 'bag:=%s %s' % (BAG, OTHER_BAG), 'spacing:=3', 'plot:=%s/round.png' % folder)
            self.assertEqual(run.returncode, 0, run.stdout)
            self.assertIn('campus_cloudy_1', run.stdout)
            self.assertIn('campus_sunny_1', run.stdout)
            self.assertNotIn('has died', run.stdout)
            self.assertEqual(sorted(os.listdir(folder)), ['round.map', 'round.png'])

    def test_a_replay_ends_with_its_drive_and_without_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            short = '%s/short.bag' % folder
            with rosbag.Bag(BAG) as whole, rosbag.Bag(short, 'w') as part:
                images = whole.read_messages(['/stereo/left/image_raw/compressed', '/gps/fix'])
                for topic, message, stamp in itertools.islice(images, 150):
                    part.write(topic, message, stamp)
            built = self.build(folder, 'bag:=%s' % short)
            self.assertEqual(built.returncode, 0, built.stdout)
            run = roslaunch('-p', str(free_port()), str(LAUNCH / 'replay.launch'), 'bag:=%s' % short,
                            'map:=%s/round.map' % folder, 'rate:=20', 'rviz:=false')
            self.assertEqual(run.returncode, 0, run.stdout)
            self.assertNotIn('has died', run.stdout)
            self.assertNotIn('play_drive:', run.stdout)

    def test_a_failure_is_said(self):
        with tempfile.TemporaryDirectory() as folder:
            run = self.build(folder, 'bag:=/absent.bag')
            self.assertIn('/absent.bag', run.stdout)
            self.assertEqual(os.listdir(folder), [])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
