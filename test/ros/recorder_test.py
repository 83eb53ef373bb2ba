#!/usr/bin/env python3
"""A session is recorded while it is driven: killed at any moment its bag is whole, and a call writes its map."""
import pathlib
import signal
import subprocess
import tempfile
import unittest

import rosbag
import roslib.packages
import rospy
import rostest
from sensor_msgs.msg import CameraInfo
from visualization_msgs.msg import Marker

import localizer_fixture as fixture
from visual_localization.srv import WriteMap

DEADLINE_S = 60.0 * fixture.SLOWNESS
RECORDER = roslib.packages.find_node('visual_localization', 'map_recorder')[0]
MAP_INFO = roslib.packages.find_node('visual_localization', 'map_info')[0]


class RecorderTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.bag = rospy.get_param('~bag')
        self.diagnostics = fixture.Diagnostics('map_recorder')
        self.way = fixture.Recorder('/map_recorder/way', Marker)

    def start(self, *arguments):
        """A recorder of a bag's topics; a new process."""
        recorder = subprocess.Popen(
            [RECORDER, '_folder:=%s' % self.folder, '_image_transport:=compressed', '_sync_period:=0.5',
             'image:=/stereo/left/image_raw', 'fix:=/gps/fix', *arguments])
        self.addCleanup(recorder.wait)
        self.addCleanup(recorder.kill)
        rospy.wait_for_service('/map_recorder/write_map', DEADLINE_S)
        self.write_map = rospy.ServiceProxy('/map_recorder/write_map', WriteMap)
        return recorder

    def play(self, seconds, bag=None):
        player = fixture.Player(bag or self.bag, rate=15 / fixture.SLOWNESS, duration_s=seconds)
        fixture.wait_for(player.ended, 120.0 * fixture.SLOWNESS, 'the end of the bag')
        player.stop()

    def recorded(self):
        return sorted(self.folder.glob('session_*.bag'))

    @staticmethod
    def images_in(path):
        with rosbag.Bag(str(path)) as bag:
            return bag.get_message_count('/stereo/left/image_raw/compressed')

    def wait_for_images(self, count):
        fixture.wait_for(lambda: int(self.diagnostics.value('session', 'Images looked at')) >= count
                         if self.diagnostics.last_of('session') else False, DEADLINE_S, '%d images' % count)

    def test_a_killed_recording_is_whole(self):
        recorder = self.start()
        self.play(30)
        fixture.wait_for(lambda: self.images_in(self.recorded()[0]) > 20, DEADLINE_S, 'images on the disk')
        recorder.send_signal(signal.SIGKILL)
        recorder.wait()
        with rosbag.Bag(str(self.recorded()[0])) as bag:
            topics = bag.get_type_and_topic_info().topics
        self.assertGreater(topics['/stereo/left/image_raw/compressed'].message_count, 20)
        self.assertGreater(topics['/gps/fix'].message_count, 100)
        self.assertGreater(topics['/stereo/left/camera_info'].message_count, 20)

    def test_a_calibration_that_makes_no_map_is_said_at_once(self):
        log = fixture.LogRecorder()
        self.start()
        publisher = rospy.Publisher('/stereo/left/camera_info', CameraInfo, queue_size=10)
        fixture.wait_for(publisher.get_num_connections, DEADLINE_S, 'a subscriber of the calibration')

        def show(k, words):
            info = CameraInfo(width=320, height=240, distortion_model='plumb_bob', D=5 * [0.0])
            info.K = [k, 0.0, 160.0, 0.0, k, 120.0, 0.0, 0.0, 1.0] if k else 9 * [0.0]
            publisher.publish(info)
            fixture.wait_for(lambda: any(item.key == 'Camera' and words in item.value
                                         for status in [self.diagnostics.last_of('recording')] if status
                                         for item in status.values), DEADLINE_S, words)
        show(0.0, 'not calibrated')
        for k in (266.0, 0.0, 266.0 + 1e-7):
            show(k, '320 x 240 px, focal length 266 x 266 px')
        self.assertFalse([line for line in log.messages() if 'Calibration' in line.msg])
        show(270.0, '266 px')
        log.wait_for('Calibration of the camera: the calibration changes', DEADLINE_S)

    def test_a_map_is_written_while_it_records(self):
        recorder = self.start()
        early = self.write_map('')
        self.assertFalse(early.success)
        self.assertNotIn('\n', early.message)
        self.play(150)
        self.wait_for_images(50)
        self.assertEqual(self.diagnostics.last_of('recording').level, fixture.Diagnostics.OK)
        fixture.wait_for(lambda: self.way.last() and len(self.way.last().points) > 50, DEADLINE_S, 'the way')
        self.assertIn('must end in .map', self.write_map(self.recorded()[0].name).message)
        for outside in ('/etc/campus.map', '../campus.map'):
            answer = self.write_map(outside)
            self.assertFalse(answer.success)
            self.assertIn('is not below', answer.message)
        answer = self.write_map('campus.map')
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.map, str(self.folder.resolve() / 'campus.map'))
        self.assertGreater(answer.images, 20)
        self.assertEqual(subprocess.run([MAP_INFO, answer.map, '--check'], stdout=subprocess.DEVNULL).returncode, 0)

        before = int(self.diagnostics.value('recording', 'Messages'))
        self.play(10)
        fixture.wait_for(lambda: int(self.diagnostics.value('recording', 'Messages')) > before, DEADLINE_S,
                         'more messages')
        recorder.send_signal(signal.SIGINT)
        recorder.wait()
        self.extend(answer.map)

    def extend(self, map_file):
        """A second session is added to the map that the first one made."""
        self.diagnostics.clear()
        self.start('_map:=' + map_file)
        self.play(100, self.bag.replace('cloudy', 'sunny'))
        self.wait_for_images(30)
        self.assertGreater(float(self.diagnostics.value('session', 'Way that the map has (%)')), 50.0)
        answer = self.write_map('both.map')
        self.assertTrue(answer.success, answer.message)
        listed = subprocess.run([MAP_INFO, answer.map], stdout=subprocess.PIPE, universal_newlines=True).stdout
        self.assertRegex(listed, r'sessions: +2')

    def test_bad_parameters_stop_it_in_one_line(self):
        for arguments, expected in ((['_folder:='], "'folder'"), (['_folder:=/absent'], '/absent'),
                                    (['_folder:=/tmp', '_image_transport:=theora'], 'raw, compressed'),
                                    (['_folder:=/tmp', '_typo:=1'], "'typo'"),
                                    (['_folder:=/tmp', '_map:=/absent.map'], '/absent.map'),
                                    (['_folder:=/tmp', '_builder_config:=/absent.yaml'], '/absent.yaml')):
            rospy.delete_param('/map_recorder') if rospy.has_param('/map_recorder') else None
            run = subprocess.run([RECORDER, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                 universal_newlines=True, timeout=DEADLINE_S)
            self.assertEqual(run.returncode, 1, arguments)
            self.assertIn(expected, run.stdout)
            self.assertEqual(len(run.stdout.strip().splitlines()), 1, run.stdout)
        rospy.delete_param('/map_recorder')


if __name__ == '__main__':
    rospy.init_node('recorder_test')
    rostest.rosrun('visual_localization', 'recorder', RecorderTest)
