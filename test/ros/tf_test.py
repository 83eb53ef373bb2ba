#!/usr/bin/env python3
"""Transforms: with odometry map, odom and base agree with a metric pose, and no other pose moves the robot; without
odometry nothing is broadcast. A filter on ~metric_pose gets the same poses."""
import itertools
import math
import sys
import time
import unittest

import cv2
import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from sensor_msgs.msg import CompressedImage
from tf2_msgs.msg import TFMessage

import localizer_fixture as fixture
from visual_localization.msg import LocalizationStatus

DEADLINE_S = 30.0
PERIOD_S = 0.3  # between images
ANSWER_S = 3.0  # then the image was dropped
TOLERANCE_S = 0.1


def yaw_of(rotation):
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def dark_image():
    image = CompressedImage(format='png')
    image.data = cv2.imencode('.png', np.zeros((240, 320), np.uint8))[1].tobytes()
    return image


def base_in_odom(stamp, x, y, yaw):
    transform = TransformStamped(child_frame_id='base_link')
    transform.header.frame_id = 'odom'
    transform.header.stamp = stamp
    transform.transform.translation.x = x
    transform.transform.translation.y = y
    transform.transform.rotation.z = math.sin(0.5 * yaw)
    transform.transform.rotation.w = math.cos(0.5 * yaw)
    return transform


class LocalizerWithOdometry(unittest.TestCase):
    """Shows images of a drive, with odometry of their stamps."""

    def setUp(self):
        self.camera = rospy.Publisher('/stereo/left/image_raw/compressed', CompressedImage, queue_size=1)
        self.odometry = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self.transforms = fixture.Recorder('/tf', TFMessage)
        self.poses = fixture.Recorder('/localizer/pose', PoseWithCovarianceStamped)
        self.metric_poses = fixture.Recorder('/localizer/metric_pose', PoseWithCovarianceStamped)
        self.diagnostics = fixture.Diagnostics('localizer')
        self.localizer = fixture.Localizer()
        self.localizer.wait_until_up()
        for publisher in (self.camera, self.odometry):
            fixture.wait_for(lambda: fixture.others(publisher), DEADLINE_S, 'a subscriber')
        fixture.wait_for(self.transforms.is_connected, DEADLINE_S, 'the transforms of the localizer')
        self.images = itertools.cycle(fixture.images_of(rospy.get_param('~bag'), count=20))

    def show(self, images, sources, odometry=None):
        """Shows images, with odometry of the same stamp if given, until there is such a pose for one."""
        def seen():
            image = next(images)
            stamp = image.header.stamp = rospy.Time.now()
            if odometry:
                self.odometry.publish(TFMessage([base_in_odom(stamp, *odometry)]))
            self.camera.publish(image)
            time.sleep(PERIOD_S)

            def of_image(recorder):
                return fixture.value_within(ANSWER_S, lambda: [m for m in recorder.messages() if m.header.stamp == stamp])
            status = of_image(self.localizer.status)
            return status and status[0].source_name in sources and of_image(self.poses)
        return fixture.wait_for(seen, DEADLINE_S, 'a pose that is ' + ' or '.join(sources))[0]

    def show_metric(self, odometry=None):
        self.localizer.status.clear()
        pose = self.show(self.images, ('METRIC',), odometry)
        while self.localizer.status.last().state != LocalizationStatus.TRACKING:
            pose = self.show(self.images, ('METRIC',), odometry)
        return pose

    def show_dark(self, odometry=None):
        return self.show(iter(dark_image, None), ('NONE', 'PLACE'), odometry)

    def transform_with(self, pose):
        stamp = pose.header.stamp + rospy.Duration(TOLERANCE_S)
        return fixture.wait_for(lambda: [t for t in self.from_map() if t.header.stamp == stamp], DEADLINE_S,
                                'the transform of an image')[0]

    def from_map(self):
        return [t for message in self.transforms.messages() for t in message.transforms if t.header.frame_id == 'map']


class TfTest(LocalizerWithOdometry):
    def test_1_before_the_first_metric_pose_nothing_is_broadcast(self):
        self.show_dark((3.0, -2.0, 0.7))
        self.assertEqual(self.from_map(), [])
        self.assertIn('no metric pose', self.diagnostics.wait_for('transform', self.diagnostics.WARN, DEADLINE_S))

    def test_2_without_odometry_nothing_is_broadcast(self):
        def warned():
            self.show_metric()  # again and again: it may be late
            last = self.diagnostics.last_of('transform')
            return last and last.level == last.WARN and 'no transform from odom to base_link' in last.message
        fixture.wait_for(warned, DEADLINE_S, 'a warning of missing odometry')
        self.assertEqual(self.from_map(), [])

    def test_3_with_odometry_the_chain_leads_to_the_pose(self):
        odometry = (3.0, -2.0, 0.7)
        pose = self.show_metric(odometry)
        self.check_chain(odometry, pose)
        self.diagnostics.wait_for('transform', self.diagnostics.OK, DEADLINE_S)

    def check_chain(self, odometry, pose):
        transform = self.transform_with(pose)
        self.assertEqual(transform.child_frame_id, 'odom')
        yaw = yaw_of(transform.transform.rotation)
        x, y, base_yaw = odometry
        self.assertAlmostEqual(transform.transform.translation.x + math.cos(yaw) * x - math.sin(yaw) * y,
                               pose.pose.pose.position.x, places=6)
        self.assertAlmostEqual(transform.transform.translation.y + math.sin(yaw) * x + math.cos(yaw) * y,
                               pose.pose.pose.position.y, places=6)
        self.assertAlmostEqual(math.cos(yaw + base_yaw - yaw_of(pose.pose.pose.orientation)), 1.0, places=6)

    def test_4_other_poses_leave_it_to_odometry(self):
        before = self.transform_with(self.show_metric((3.0, -2.0, 0.7)))
        after = self.transform_with(self.show_dark((4.0, -2.0, 0.7)))
        self.assertEqual(after.child_frame_id, 'odom')
        self.assertEqual(after.transform, before.transform)

    def test_5_a_filter_gets_those_that_are_tracking_and_what_the_image_says(self):
        pose = self.show_metric()
        dark = self.show_dark()
        claims = {status.header.stamp for status in self.localizer.status.messages()
                  if status.state == LocalizationStatus.TRACKING and status.source == LocalizationStatus.METRIC}
        self.assertNotIn(dark.header.stamp, claims)
        fused = {message.header.stamp: message.pose for message in self.metric_poses.messages()}
        self.assertLessEqual(set(fused), claims)
        self.assertEqual(fused[pose.header.stamp].pose, pose.pose.pose)
        self.assertLess(fused[pose.header.stamp].covariance[0], pose.pose.covariance[0])

    def test_6_odometry_may_come_after_the_pose(self):
        odometry = (3.0, -2.0, 0.7)
        pose = self.show_metric()
        self.odometry.publish(TFMessage([base_in_odom(pose.header.stamp, *odometry)]))
        self.check_chain(odometry, pose)


if __name__ == '__main__':
    rospy.init_node('tf_test')
    rostest.rosrun('visual_localization', 'tf_test', TfTest, sys.argv)
