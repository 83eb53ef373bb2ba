#!/usr/bin/env python3
"""Simulated time that has not begun, stands still, goes back or ends: images are served by wall time. Stamps at the end
of time stop nobody."""
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CompressedImage
from tf2_msgs.msg import TFMessage

import localizer_fixture as fixture

DEADLINE_S = 30.0
END_S = 2 ** 32 - 1
RECORDER = roslib.packages.find_node('visual_localization', 'map_recorder')[0]


def transform_at(stamp, parent='odom', child='base_link'):
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id = parent
    transform.header.stamp = stamp
    transform.transform.rotation.w = 1.0
    return TFMessage([transform])


class SimTimeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.images = fixture.images_of(rospy.get_param('~bag'), count=40)
        cls.clock = rospy.Publisher('/clock', Clock, queue_size=1, latch=True)
        cls.diagnostics = fixture.Diagnostics('localizer')
        cls.localizer = fixture.Localizer()
        cls.localizer.wait_until_up()
        cls.camera = fixture.Camera(cls.localizer)

    def check_images_are_served(self, first):
        refused = self.localizer.counts()[1]
        for image in self.images[first:first + 3]:
            self.camera.show(image)
        before = self.localizer.counts()[0]
        for image in self.images[first + 3:first + 6]:
            image.header.stamp = rospy.Time(0)
            self.camera.publish(image)
            before += 1
            fixture.wait_for(lambda count=before: self.localizer.counts()[0] >= count, DEADLINE_S,
                             'an image without a stamp')
        self.assertEqual(self.localizer.counts()[1], refused)

    def set_clock(self, seconds):
        self.clock.publish(Clock(rospy.Time(seconds)))
        fixture.wait_for(lambda: rospy.Time.now().to_sec() == seconds, DEADLINE_S, 'the clock')
        self.diagnostics.clear()
        fixture.wait_for(lambda: any(array.header.stamp.to_sec() == seconds and 'localizer: images' in
                                     [status.name for status in array.status]
                                     for array in self.diagnostics.messages()), DEADLINE_S, 'the clock of the node')

    def test_1_before_the_first_clock(self):
        self.check_images_are_served(0)

    def test_2_while_the_clock_stands_still_and_after_it_went_back(self):
        self.set_clock(5000.0)
        self.check_images_are_served(6)
        self.set_clock(100.0)
        self.check_images_are_served(12)

    def test_3_when_the_clock_jumps_by_years_and_back(self):
        images = iter(self.images[18:])
        # 2011, 2030, 2103 and back; images without a stamp were of today.
        for seconds, is_later in ((1.3e9, False), (1.9e9, True), (4.2e9, True), (1.3e9, False)):
            self.set_clock(seconds)
            for number in range(4):
                image = next(images)
                image.header.stamp = rospy.Time.now() + rospy.Duration(0.1 * number)
                if number == 0 and not is_later:  # the first one may be late
                    self.camera.publish(image)
                else:  # insist: that one may be in the queue still, and give way
                    self.camera.show(image, insist=True)
        self.assertEqual(self.localizer.counts()[1], 0)

    def test_4_diagnostics_go_on(self):
        """They tell of the missing odometry as well."""
        message = self.diagnostics.wait_for('transform', self.diagnostics.WARN, DEADLINE_S)
        self.assertIn('odom', message)
        self.diagnostics.wait_for('images', self.diagnostics.ERROR, DEADLINE_S)

    def show_on(self, topic, message_type, messages):
        """Sends messages until somebody has had the chance to end because of them."""
        publisher = rospy.Publisher(topic, message_type, queue_size=10)
        fixture.wait_for(publisher.get_num_connections, DEADLINE_S, 'a subscriber of ' + topic)
        for message in messages:
            publisher.publish(message)
        self.diagnostics.clear()
        self.diagnostics.wait_for('images', self.diagnostics.ERROR, DEADLINE_S)
        publisher.unregister()

    def test_5_stamps_at_the_end_of_time_stop_nobody(self):
        self.set_clock(1.3e9)
        ends = [rospy.Time(END_S - before, 999999999) for before in (0, 5, 20, 86400)]
        self.show_on('/tf', TFMessage, [transform_at(stamp) for stamp in ends])
        refused = self.localizer.counts()[1]
        for stamp in ends:
            image = CompressedImage(header=self.images[0].header, format='jpeg', data=self.images[0].data)
            image.header.stamp = stamp
            self.camera.publish(image)
            fixture.wait_for(lambda: float(self.diagnostics.value('images', 'Refused')) > refused, DEADLINE_S,
                             'the refusal of an image')
            refused = float(self.diagnostics.value('images', 'Refused'))
        image = self.images[1]
        image.header.stamp = rospy.Time(1.3e9 + 60.0)
        self.camera.show(image, insist=True)

    def test_6_a_clock_at_the_end_of_time_stops_nobody(self):
        with tempfile.TemporaryDirectory() as folder:
            recorder = subprocess.Popen([RECORDER, '_folder:=' + folder, '_image_transport:=compressed',
                                         'image:=/stereo/left/image_raw', 'fix:=/gps/fix'])
            try:
                rospy.wait_for_service('/map_recorder/write_map', DEADLINE_S)
                log = fixture.LogRecorder()
                self.clock.publish(Clock(rospy.Time(END_S, 999999999)))
                log.wait_for('diagnostics: ', DEADLINE_S)  # theirs cannot be sent
                self.camera.publish(self.images[2])
                self.set_clock(1.3e9)
                self.check_images_are_served(30)
                self.assertIsNone(recorder.poll())
            finally:
                recorder.terminate()
                recorder.wait()


if __name__ == '__main__':
    rospy.init_node('sim_time_test')
    rostest.rosrun('visual_localization', 'sim_time_test', SimTimeTest, sys.argv)
