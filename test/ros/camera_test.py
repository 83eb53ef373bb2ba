#!/usr/bin/env python3
"""Whatever a camera makes of the same street: usable images are localised, useless ones are said to be so."""
import itertools
import os
import pathlib
import sys
import time
import unittest

import cv2
import numpy as np
import rospy
import rostest
from sensor_msgs.msg import Image

import localizer_fixture as fixture
from visual_localization.msg import LocalizationStatus

sys.path.insert(0, str(pathlib.Path(os.path.realpath(__file__)).parents[1] / 'support'))
import camera_faults as faults  # noqa: E402

DEADLINE_S = 30.0
NEAR_M = 8.0
OLD_S = 1.0  # an image that repeats one from so long ago says nothing
TRACKING = LocalizationStatus.TRACKING


def coloured(grey):
    """Evening light, as BGR."""
    return faults.to_bytes(grey[:, :, np.newaxis] * np.array([0.9, 1.0, 1.1]))


def mosaic(grey):
    """What a sensor with the pattern RGGB sees."""
    bgr = coloured(grey)
    raw = bgr[:, :, 1].copy()
    raw[0::2, 0::2] = bgr[0::2, 0::2, 2]
    raw[1::2, 1::2] = bgr[1::2, 1::2, 0]
    return raw


FORMATS = {
    'half resolution': ('mono8', lambda grey: faults.scaled(grey, 0.5)),
    'double resolution': ('mono8', lambda grey: faults.scaled(grey, 2.0)),
    'stretched to 16:9': ('mono8', lambda grey: cv2.resize(grey, (428, 240))),
    'bgr8': ('bgr8', coloured),
    'rgb8': ('rgb8', lambda grey: coloured(grey)[:, :, ::-1]),
    'bayer': ('bayer_rggb8', mosaic),
    'mono16': ('mono16', lambda grey: (grey.astype(np.uint16) * 257)),
}


class CameraTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        bag = rospy.get_param('~bag')
        cls.truth = fixture.truth_of(bag)
        cls.images = ((cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_GRAYSCALE), image.header.stamp)
                      for image in fixture.images_of(bag))
        cls.generator = np.random.default_rng(1)
        cls.diagnostics = fixture.Diagnostics('localizer')
        cls.log = fixture.LogRecorder()
        cls.localizer = fixture.Localizer()
        cls.localizer.wait_until_up()
        cls.camera = fixture.Camera(cls.localizer, '/camera', Image)
        fixture.wait_for(cls.log.is_connected, DEADLINE_S, 'the log')

    def drive(self, count, change=lambda grey: grey, encoding='mono8'):
        """Shows the next images of the drive as `change` makes them; their statuses."""
        return [self.camera.show(fixture.image_of(change(grey), encoding, stamp))
                for grey, stamp in itertools.islice(self.images, count)]

    def spoilt(self, fault):
        return lambda grey: faults.FAULTS[fault](grey, 0, self.generator)

    def drive_until_tracking(self, most=60, in_a_row=1):
        """How many images that took."""
        tracking = 0
        for count in range(1, most + 1):
            tracking = tracking + 1 if self.drive(1)[0].state == TRACKING else 0
            if tracking == in_a_row:
                return count
        raise AssertionError('not TRACKING within %d images' % most)

    def errors_m(self, statuses):
        """Of the claims of TRACKING among them."""
        tracking = {status.header.stamp for status in statuses if status.state == TRACKING}

        def fixes():
            return [fix for fix in self.localizer.fix.messages() if fix.header.stamp in tracking]
        fixture.wait_for(lambda: len(fixes()) == len(tracking), DEADLINE_S, 'the fixes')
        return fixture.errors_m(fixes(), self.truth)

    def check_localised(self, name, statuses, most_lost):
        errors = self.errors_m(statuses)
        print('%s: %d of %d images TRACKING, errors up to %.1f m' % (
            name, len(errors), len(statuses), max(errors, default=0.0)))
        self.assertGreaterEqual(len(errors), max(1, len(statuses) - most_lost), name)
        self.assertLess(max(errors), NEAR_M, name)

    def test_1_formats_of_the_same_street(self):
        print('TRACKING after %d images' % self.drive_until_tracking())
        for name, (encoding, change) in FORMATS.items():
            self.check_localised(name, self.drive(8, change, encoding), most_lost=1)
        self.assertEqual(self.localizer.counts()[1], 0, 'nothing is refused')

    def test_2_scratchy_images_are_localised(self):
        for fault in ('motion blur of 7 pixels', 'dirt on 10 % of the image', 'noise of 10 grey levels',
                      'bright, twice the light'):
            self.drive_until_tracking()
            self.check_localised(fault, self.drive(8, self.spoilt(fault)), most_lost=2)

    def test_3_images_that_show_nothing(self):
        for fault, guess in (('dark, a twentieth of the light', 'dark or covered?'), ('black', 'dark or covered?'),
                             ('white', 'overexposed?'), ('noise alone', None)):
            self.drive_until_tracking()
            states = [status.state for status in self.drive(8, self.spoilt(fault))]
            self.assertNotIn(TRACKING, states[3:], fault)
            if guess:
                message = self.diagnostics.wait_for('images', self.diagnostics.WARN, DEADLINE_S)
                print('%s: %s' % (fault, message))
                self.assertIn(guess, message)
            print('%s: TRACKING again after %d images' % (fault, self.drive_until_tracking()))
        self.diagnostics.wait_for('images', self.diagnostics.OK, DEADLINE_S)
        self.log.wait_for('dark or covered?', DEADLINE_S)

    def show_until_logged(self, grey, stamp, text):
        """The log repeats itself at most once in 5 s."""
        def logged():
            stamps.append(stamps[-1] + rospy.Duration(0.002))
            self.camera.show(fixture.image_of(grey, 'mono8', stamps[-1]))
            time.sleep(0.05)
            return any(text in line.msg for line in self.log.messages())
        stamps = [stamp]
        fixture.wait_for(logged, DEADLINE_S, '"%s" in the log' % text)

    def test_4_a_frozen_camera(self):
        self.drive_until_tracking(in_a_row=5)
        grey, _ = next(self.images)
        self.log.clear()
        shown = [fixture.image_of(grey, 'mono8', stamp) for _, stamp in itertools.islice(self.images, 12)]
        states = [self.camera.show(image).state for image in shown]
        ages = [(image.header.stamp - shown[0].header.stamp).to_sec() for image in shown]
        self.assertEqual(states, [TRACKING if age < OLD_S else LocalizationStatus.UNCERTAIN for age in ages],
                         'some cameras send an image twice, but none says where the robot is a second later')
        self.assertIn(TRACKING, states[1:3])
        message = self.diagnostics.wait_for('images', self.diagnostics.WARN, DEADLINE_S)
        self.assertEqual(message, 'The camera has sent the same image 12 times: frozen?')
        self.show_until_logged(grey, shown[-1].header.stamp, 'the same image')
        frozen = {image.header.stamp for image in shown[3:]}
        self.assertFalse([fix for fix in self.localizer.fix.messages() if fix.header.stamp in frozen],
                         'there is no pose without news')
        images = self.drive_until_tracking()
        print('TRACKING %d images after the frozen ones' % images)
        self.assertLessEqual(images, 4, 'the filter still knows where the robot was')
        self.check_localised('after the frozen ones', self.drive(5), most_lost=1)
        self.diagnostics.wait_for('images', self.diagnostics.OK, DEADLINE_S)


if __name__ == '__main__':
    rospy.init_node('camera_test')
    rostest.rosrun('visual_localization', 'camera_test', CameraTest, sys.argv)
