#!/usr/bin/env python3
"""With tf_rate the transform comes between images, too: small corrections slide in, and after long without an image it
ends."""
import itertools
import math
import sys
import time

import rospy
import rostest
from tf2_msgs.msg import TFMessage

import localizer_fixture as fixture
import tf_test

DEADLINE_S = 30.0
SILENCE_S = 1.0
IMAGE_TIMEOUT_S = 3.0
SMOOTHING_S = 0.5


class TfRateTest(tf_test.LocalizerWithOdometry):
    def robot_in(self, transforms, odometry):
        """Where they have a robot that is there by odometry."""
        x, y, _ = odometry
        for transform in transforms:
            yaw = tf_test.yaw_of(transform.transform.rotation)
            yield (transform.transform.translation.x + math.cos(yaw) * x - math.sin(yaw) * y,
                   transform.transform.translation.y + math.sin(yaw) * x + math.cos(yaw) * y)

    def test_1_it_comes_between_images(self):
        odometry = (3.0, -2.0, 0.7)
        pose = self.show_metric(odometry)
        fixture.wait_for(self.from_map, DEADLINE_S, 'a transform')
        begin = time.monotonic()
        self.transforms.clear()
        fixture.wait_for(lambda: len(self.from_map()) >= 20, DEADLINE_S, 'transforms without an image')
        self.assertLess(time.monotonic() - begin, IMAGE_TIMEOUT_S)
        transforms = self.from_map()
        stamps = [t.header.stamp for t in transforms]
        self.assertEqual(stamps, sorted(set(stamps)))
        self.assertEqual({t.child_frame_id for t in transforms}, {'odom'})
        x, y = list(self.robot_in(transforms, odometry))[-1]
        self.assertLess(math.hypot(x - pose.pose.pose.position.x, y - pose.pose.pose.position.y), 0.5)

    def test_2_it_ends_without_images(self):
        pose = self.show_metric((3.0, -2.0, 0.7))
        fixture.wait_for(self.from_map, DEADLINE_S, 'a transform')

        def newest():
            return self.from_map()[-1].header.stamp
        fixture.wait_for(lambda: (rospy.Time.now() - newest()).to_sec() > SILENCE_S, DEADLINE_S,
                         'the end of the transforms')
        self.assertGreater((newest() - pose.header.stamp).to_sec(), 0.5 * IMAGE_TIMEOUT_S)

    def test_3_odometry_may_come_after_the_only_image(self):
        pose = self.show_metric()
        self.transforms.clear()
        self.odometry.publish(TFMessage([tf_test.base_in_odom(pose.header.stamp, 5.0, 1.0, -0.4)]))
        position = pose.pose.pose.position

        def is_there():  # until the odometry has arrived, transforms are those of the pose before
            return any(math.hypot(x - position.x, y - position.y) < 0.5
                       for x, y in self.robot_in(self.from_map(), (5.0, 1.0, -0.4)))
        fixture.wait_for(is_there, DEADLINE_S, 'a transform to the pose of the image')

    def test_4_a_small_correction_slides_in(self):
        images = [next(self.images), next(self.images)]
        true = []
        for image in images:  # a robot that rolls back and forth
            self.images = itertools.cycle([image])
            pose = self.show(self.images, ('METRIC',), (0.0, 0.0, 0.0)).pose.pose
            true.append((pose.position.x, pose.position.y, tf_test.yaw_of(pose.orientation)))

        def roll(offset_m, times):
            """Shows both images, with odometry that is off by so much in x."""
            for image, (x, y, yaw) in times * list(zip(images, true)):
                self.show(iter(lambda: image, None), ('METRIC',), (x + offset_m, y, yaw))

        roll(0.0, 3)
        self.transforms.clear()
        roll(0.2, 4)
        transforms = self.from_map()
        offsets = [x - true[1][0] for x, _ in self.robot_in(transforms, true[1])]
        self.assertLess(abs(offsets[0]), 0.1)
        self.assertAlmostEqual(offsets[-1], -0.2, delta=0.05)
        stamps = [t.header.stamp.to_sec() for t in transforms]
        for k in range(1, len(offsets)):
            largest = 0.4 * (1.0 - math.exp(-(stamps[k] - stamps[k - 1]) / SMOOTHING_S)) + 0.02
            self.assertLess(abs(offsets[k] - offsets[k - 1]), largest, 'no jump')


if __name__ == '__main__':
    rospy.init_node('tf_rate_test')
    rostest.rosrun('visual_localization', 'tf_rate_test', TfRateTest, sys.argv)
