#!/usr/bin/env python3
"""A localizer records what it verifies as a new session of its map, and counts what its poses rest on."""
import csv
import pathlib
import signal
import subprocess
import tempfile
import unittest

import rosbag
import roslib.packages
import rospy
import rostest

import localizer_fixture as fixture
from sensor_msgs.msg import NavSatFix
from visual_localization.srv import LoadMap, RecordSession

DEADLINE_S = 60.0
LOCALIZER = roslib.packages.find_node('visual_localization', 'localizer_node')[0]
MAP_EDIT = roslib.packages.find_node('visual_localization', 'map_edit')[0]
MAP_INFO = roslib.packages.find_node('visual_localization', 'map_info')[0]
IMAGES = '/session/image/compressed'
BEGIN, END = True, False


def output_of(command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True,
                          timeout=DEADLINE_S)


class SessionsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name).resolve()
        self.bag = rospy.get_param('~bag')
        self.map = rospy.get_param('~map')
        if rospy.has_param('/localizer'):
            rospy.delete_param('/localizer')
        self.localizer = fixture.Localizer()

    def command(self, *arguments):
        return [LOCALIZER, '__name:=localizer', '_map:=' + self.map, '_image_transport:=compressed',
                'image:=/stereo/left/image_raw', *arguments]

    def start(self, *arguments):
        """A localizer; a new process."""
        process = subprocess.Popen(self.command(*arguments))
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        rospy.wait_for_service('/localizer/record_session', DEADLINE_S)
        self.record_session = rospy.ServiceProxy('/localizer/record_session', RecordSession)
        self.localizer.wait_until_up()
        return process

    def drive(self, count):
        """Shows images until so many poses are metric."""
        camera = fixture.Camera(self.localizer)
        metric = 0
        for image in fixture.images_of(self.bag):
            metric += camera.show(image, insist=True).source_name == 'METRIC'
            if metric >= count:
                return
        self.fail('%d metric poses' % metric)

    def refusal(self, *request):
        answer = self.record_session(*request)
        self.assertFalse(answer.success)
        self.assertNotIn('\n', answer.message)
        return answer.message

    def recorded(self):
        return sorted(self.folder.glob('session_*.bag'))

    def test_a_session_becomes_part_of_the_map(self):
        usage = self.folder / 'usage.csv'
        localizer = self.start('_session_folder:=%s' % self.folder, '_usage_file:=%s' % usage)
        self.assertIn('no session is being recorded', self.refusal(END, ''))
        begun = self.record_session(BEGIN, '')
        self.assertTrue(begun.success, begun.message)
        self.assertIn(str(self.recorded()[0]), begun.message)
        self.assertIn('already', self.refusal(BEGIN, ''))
        self.drive(60)
        self.assertIn('is not below', self.refusal(END, '/etc/grown.map'))
        (self.folder / 'outside').symlink_to('/var/tmp')
        self.assertIn('is not below', self.refusal(END, 'outside/grown.map'))
        self.assertIn('must end in .map', self.refusal(END, 'grown.bag'))
        self.assertIn('absent/grown.map', self.refusal(END, 'absent/grown.map'))
        answer = self.record_session(END, 'grown.map')
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.map, str(self.folder / 'grown.map'))
        self.assertGreater(answer.images, 60)
        self.assertIn('no session is being recorded', self.refusal(END, ''))

        with rosbag.Bag(str(self.recorded()[0])) as bag:
            images = bag.get_message_count(IMAGES)
            self.assertEqual(bag.get_message_count('/session/verified_pose'), images)
        self.assertGreater(images, 40)
        info = output_of([MAP_INFO, answer.map, '--check'])
        self.assertEqual(info.returncode, 0, info.stdout)
        self.assertRegex(info.stdout, r'sessions: +2')
        self.assert_true_positions(answer.map)
        loaded = rospy.ServiceProxy('/localizer/load_map', LoadMap)(answer.map)
        self.assertEqual((loaded.success, loaded.images), (True, answer.images), loaded.message)

        localizer.send_signal(signal.SIGINT)
        localizer.wait()
        self.assertGreater(len(usage.read_text().splitlines()), 10)
        leaner = output_of([MAP_EDIT, 'summarise', '--map', self.map, '--usage', str(usage), '--per-place', '1',
                            '--output', str(self.folder / 'lean.map')])
        self.assertEqual(leaner.returncode, 0, leaner.stdout)

    def assert_true_positions(self, map_file):
        """The images of the second session lie where the drive was, and look where it went."""
        table = self.folder / 'map.csv'
        self.assertEqual(output_of([MAP_INFO, map_file, '--export-csv', str(table)]).returncode, 0)
        truth = fixture.truth_of(self.bag)
        errors = []
        with table.open() as file:
            for row in csv.DictReader(file):
                stamp = int(row['stamp'].replace('.', ''))
                if stamp in truth:
                    place = NavSatFix(latitude=float(row['latitude_deg']), longitude=float(row['longitude_deg']))
                    errors.append(fixture.distance_m(place, truth[stamp]))
        self.assertGreater(len(errors), 5)
        self.assertLess(sum(errors) / len(errors), 0.5)

    def test_nothing_is_added_without_a_verified_image(self):
        self.start('_session_folder:=%s' % self.folder)
        self.assertTrue(self.record_session(BEGIN, '').success)
        self.assertIn('no image was verified', self.refusal(END, ''))
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_killed_session_is_whole(self):
        localizer = self.start('_session_folder:=%s' % self.folder)
        self.assertTrue(self.record_session(BEGIN, '').success)
        self.drive(20)

        def on_disk():
            with rosbag.Bag(str(self.recorded()[0])) as bag:
                return bag.get_message_count(IMAGES) > 10
        fixture.wait_for(on_disk, DEADLINE_S, 'images on the disk, though no more come')
        localizer.send_signal(signal.SIGKILL)
        localizer.wait()
        self.assertTrue(on_disk())

    def test_a_failure_says_where_the_recording_is(self):
        copy = self.folder / 'live.map'
        copy.write_bytes(pathlib.Path(self.map).read_bytes())
        self.map = str(copy)
        self.start('_session_folder:=%s' % self.folder)
        self.assertTrue(self.record_session(BEGIN, '').success)
        self.drive(10)
        self.assertIn('is the map that the session extends', self.refusal(END, 'live.map'))
        copy.unlink()
        message = self.refusal(END, 'grown.map')
        self.assertIn('live.map', message)
        self.assertIn(str(self.recorded()[0]), message)
        self.assertTrue(self.record_session(BEGIN, '').success, 'and the next one begins')

    def test_without_a_folder_it_says_so(self):
        self.start()
        self.assertIn('session_folder', self.refusal(BEGIN, ''))

    def test_bad_parameters_stop_the_start_in_one_line(self):
        text = self.folder / 'notes.txt'
        text.write_text('shopping list\n')
        held = self.folder / 'held.csv'
        self.start('_usage_file:=%s' % held)
        self.assertIn('is writing it', output_of(self.command('__name:=other', '_usage_file:=%s' % held)).stdout)
        for argument, expected in (('_usage_file:=%s' % text, str(text)), ('_usage_file:=/absent/usage.csv', '/absent'),
                                   ('_session_folder:=maps', "'session_folder'"), ('_usage_file:=used.csv', "'usage_file'"), ('_tf_rate:=-1.0', "'tf_rate'")):
            rospy.delete_param('/localizer') if rospy.has_param('/localizer') else None
            run = output_of(self.command(argument))
            self.assertNotEqual(run.returncode, 0, argument)
            self.assertIn(expected, run.stdout)
        self.assertEqual(text.read_text(), 'shopping list\n')


if __name__ == '__main__':
    rospy.init_node('sessions_test')
    rostest.rosrun('visual_localization', 'sessions_test', SessionsTest)
