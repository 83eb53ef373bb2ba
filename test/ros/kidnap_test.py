#!/usr/bin/env python3
"""A robot that is carried elsewhere finds its new position, told so by ~relocalize or not."""
import sys
import unittest

import cv2
import numpy as np
import rospy
import rostest
from sensor_msgs.msg import CompressedImage
from std_srvs.srv import Empty

import localizer_fixture as fixture
from visual_localization.msg import LocalizationStatus
from visual_localization.srv import Relocalize, RelocalizeRequest

NEAR_M = 1.0
IN_A_ROW = 5
BEFORE_S = (0.0, 80.0)    # start in the bag and length
AFTER_S = (230.0, 120.0)


class KidnapTest(unittest.TestCase):
    def setUp(self):
        self.bag = rospy.get_param('~bag')
        self.rate = rospy.get_param('~rate')
        self.truth = fixture.truth_of(self.bag)
        self.localizer = fixture.Localizer()
        self.localizer.wait_until_up()
        self.relocalize = rospy.ServiceProxy('/localizer/relocalize', Relocalize)
        self.relocalize.wait_for_service(30.0)

    def on_track(self):
        """The last images are confirmed and near the truth."""
        status = self.localizer.status.last()
        errors = fixture.errors_m(self.localizer.fix.messages()[-IN_A_ROW:], self.truth)
        return (status is not None and status.state == LocalizationStatus.TRACKING and len(errors) == IN_A_ROW
                and max(errors) < NEAR_M)

    def drive(self, part):
        player = fixture.Player(self.bag, self.rate, *part)
        try:
            fixture.wait_for(lambda: self.on_track() or player.ended(), 200.0, 'the track or the end of the bag')
            self.assertTrue(self.on_track(), 'not on track by the end of the bag')
        finally:
            player.stop()

    def show_black(self):
        """The status of an image that moves no particle anywhere, taken after those of the bag."""
        fixture.wait_for_silence(self.localizer)
        black = CompressedImage(format='png', data=cv2.imencode('.png', np.zeros((240, 320), np.uint8))[1].tobytes())
        black.header.stamp = self.localizer.status.last().header.stamp + rospy.Duration(1.0)
        return fixture.Camera(self.localizer).show(black)

    def test_relocalize_after_a_jump(self):
        self.drive(BEFORE_S)
        self.localizer.fix.clear()
        self.localizer.status.clear()
        self.assertTrue(self.relocalize(RelocalizeRequest(use_centre=False)).success)
        self.drive(AFTER_S)

    def test_a_jump_that_nobody_announces(self):
        """The stamps jump too, as after a pause."""
        self.drive(BEFORE_S)
        self.localizer.fix.clear()
        self.localizer.status.clear()
        self.drive(AFTER_S)
        claims = {status.header.stamp for status in self.localizer.status.messages()
                  if status.state == LocalizationStatus.TRACKING}
        fixes = [fix for fix in self.localizer.fix.messages() if fix.header.stamp in claims]
        self.assertLess(max(fixture.errors_m(fixes, self.truth)), NEAR_M, 'no claim of the old position')

    def test_searching_can_be_asked_for_by_the_name_amcl_uses(self):
        self.drive(BEFORE_S)
        before = self.show_black()
        rospy.wait_for_service('/global_localization', 10.0)
        rospy.ServiceProxy('/global_localization', Empty)()
        after = self.show_black()
        self.assertIn(before.state, (LocalizationStatus.TRACKING, LocalizationStatus.UNCERTAIN))
        self.assertEqual(after.state, LocalizationStatus.INITIALIZING)

    def test_a_disc_that_is_none_is_refused_with_a_reason(self):
        for radius in (0.0, -1.0, float('nan')):
            answer = self.relocalize(RelocalizeRequest(use_centre=True, radius=radius))
            self.assertFalse(answer.success)
            self.assertIn('radius', answer.message)


if __name__ == '__main__':
    rospy.init_node('kidnap_test')
    rostest.rosrun('visual_localization', 'kidnap_test', KidnapTest, sys.argv)
