#!/usr/bin/env python3
"""Images that come faster than they are answered, and large ones: memory stays, the newest one counts."""
import sys
import unittest

import cv2
import numpy as np
import rospy
import rostest
from sensor_msgs.msg import Image

import localizer_fixture as fixture

SCALE = 8.0  # 2560 x 1920 pixels, 4.7 MB
FLOOD = 400  # 1.9 GB in all
DEADLINE_S = 60.0


class FloodTest(unittest.TestCase):
    def test_memory_is_bounded_and_the_newest_image_is_answered(self):
        localizer = fixture.Localizer()
        localizer.wait_until_up()
        camera = fixture.Camera(localizer, '/camera', Image)
        first = fixture.images_of(rospy.get_param('~bag'), 0, 1)[0]
        grey = cv2.imdecode(np.frombuffer(first.data, np.uint8), cv2.IMREAD_GRAYSCALE)
        large = cv2.resize(grey, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_LINEAR)
        stamp = first.header.stamp

        def image(number):
            pixels = large.copy()
            pixels[0, :] = number % 251  # no two in a row are the same
            return fixture.image_of(pixels, 'mono8', stamp + rospy.Duration(0.1 * number))

        for number in range(3):  # what it needs for images of this size
            camera.show(image(number), DEADLINE_S, insist=True)
        before_mb = fixture.memory_mb('/localizer')
        peak_mb = before_mb
        for number in range(3, FLOOD):
            camera.publish(image(number))
            if number % 20 == 0:
                peak_mb = max(peak_mb, fixture.memory_mb('/localizer'))
        last = camera.show(image(FLOOD), DEADLINE_S, insist=True)
        after_mb = fixture.memory_mb('/localizer')
        rospy.loginfo('memory %.0f MB before, %.0f in the flood, %.0f after; %d answered, %d dropped', before_mb, peak_mb,
                      after_mb, last.images_processed, last.images_dropped)
        self.assertLess(last.images_processed + last.images_dropped, FLOOD + 100)
        self.assertLess(last.images_processed, 0.8 * FLOOD, 'that was no flood')
        self.assertLess(peak_mb - before_mb, 60.0, 'room for a dozen images')
        self.assertLess(after_mb - before_mb, 60.0)


if __name__ == '__main__':
    rospy.init_node('flood_test')
    rostest.rosrun('visual_localization', 'flood_test', FloodTest, sys.argv)
