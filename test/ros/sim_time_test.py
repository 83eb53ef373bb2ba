#!/usr/bin/env python3
"""Simulated time that has not begun, stands still or goes back: images are served by wall time."""
import sys
import unittest

import rospy
import rostest
from rosgraph_msgs.msg import Clock

import localizer_fixture as fixture

DEADLINE_S = 30.0


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
        for image in self.images[first:first + 3]:
            self.camera.show(image)
        before = self.localizer.counts()[0]
        for image in self.images[first + 3:first + 6]:
            image.header.stamp = rospy.Time(0)
            self.camera.publish(image)
            before += 1
            fixture.wait_for(lambda count=before: self.localizer.counts()[0] >= count, DEADLINE_S,
                             'an image without a stamp')
        self.assertEqual(self.localizer.counts()[1], 0)

    def set_clock(self, seconds):
        self.clock.publish(Clock(rospy.Time(seconds)))
        fixture.wait_for(lambda: rospy.Time.now().to_sec() == seconds, DEADLINE_S, 'the clock')

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


if __name__ == '__main__':
    rospy.init_node('sim_time_test')
    rostest.rosrun('visual_localization', 'sim_time_test', SimTimeTest, sys.argv)
