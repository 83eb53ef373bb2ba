#!/usr/bin/env python3
"""A robot that is carried elsewhere and told so by ~relocalize finds its new position."""
import sys
import unittest

import rospy
import rostest
from std_srvs.srv import Empty

import localizer_fixture as fixture
from visual_localization.msg import LocalizationStatus
from visual_localization.srv import Relocalize, RelocalizeRequest

NEAR_M = 5.0
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

    def test_relocalize_after_a_jump(self):
        self.drive(BEFORE_S)
        self.localizer.fix.clear()
        self.localizer.status.clear()
        self.assertTrue(self.relocalize(RelocalizeRequest(use_centre=False)).success)
        self.drive(AFTER_S)

    def test_searching_can_be_asked_for_by_the_name_amcl_uses(self):
        rospy.wait_for_service('/global_localization', 10.0)
        rospy.ServiceProxy('/global_localization', Empty)()

    def test_a_disc_that_is_none_is_refused_with_a_reason(self):
        for radius in (0.0, -1.0, float('nan')):
            answer = self.relocalize(RelocalizeRequest(use_centre=True, radius=radius))
            self.assertFalse(answer.success)
            self.assertIn('radius', answer.message)


if __name__ == '__main__':
    rospy.init_node('kidnap_test')
    rostest.rosrun('visual_localization', 'kidnap_test', KidnapTest, sys.argv)
