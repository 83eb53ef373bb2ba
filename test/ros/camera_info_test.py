#!/usr/bin/env python3
"""The calibration of the live camera: from the topic beside the images or from a file, changed, and refused."""
import sys
import unittest

import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage

import localizer_fixture as fixture

DEADLINE_S = 30.0


def info(focal_length=266.2847172, **changes):
    """That of the sample rounds, unless something is changed."""
    message = CameraInfo(width=320, height=240, distortion_model='plumb_bob', D=5 * [0.0])
    message.K = [focal_length, 0, 159.5, 0, focal_length, 119.5, 0, 0, 1]
    for name, value in changes.items():
        setattr(message, name, value)
    return message


class CameraInfoTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.diagnostics = fixture.Diagnostics('by_topic')
        cls.log = fixture.LogRecorder()
        cls.publisher = rospy.Publisher('/camera/camera_info', CameraInfo, queue_size=10)
        fixture.wait_for(cls.publisher.get_num_connections, 60.0, 'a subscriber of /camera/camera_info')

    def wait_for_report(self, level, text):
        def reported():
            last = self.diagnostics.last_of('camera')
            return last if last is not None and last.level == level and text in last.message else None
        return fixture.wait_for(reported, DEADLINE_S, '"%s" in diagnostics' % text)

    def logged(self, text):
        return [line.msg for line in self.log.messages() if text in line.msg and line.name == '/by_topic']

    def show(self, message):
        """As often as a camera does."""
        for _ in range(5):
            self.publisher.publish(message)

    def test_1_until_one_comes_it_is_the_map_s(self):
        self.wait_for_report(self.diagnostics.OK, 'focal length 266.3 x 266.3 px, no distortion, from the map')

    def test_2_the_topic_beside_the_images(self):
        self.show(info())
        last = self.wait_for_report(self.diagnostics.OK, 'from /camera/camera_info')
        self.assertNotIn("not the map's", last.message)
        self.log.wait_for('Camera: 320 x 240 px', DEADLINE_S)

    def test_3_what_cannot_be_is_refused_and_the_one_before_goes_on(self):
        for message, text in ((info(float('nan')), 'fx = nan'), (info(0.0), 'fx = 0'),
                              (info(distortion_model='fov'), "unknown distortion model 'fov'"),
                              (info(D=3 * [0.1]), 'takes 0, 4 or 5'), (info(width=0), 'image size 0 x 240')):
            self.show(message)
            last = self.wait_for_report(self.diagnostics.WARN, text)
            self.assertIn('266.3', {item.key: item.value for item in last.values}['In use'])
        self.assertEqual(len(self.logged('fx = nan')), 1, 'said once')
        self.show(info(K=9 * [0.0]))  # of a second publisher: nothing about this camera
        self.show(info())
        self.wait_for_report(self.diagnostics.OK, 'from /camera/camera_info')
        self.assertEqual(self.logged('is not calibrated'), [])

    def test_4_another_camera_than_the_map_s_is_said_once(self):
        self.log.clear()
        other = info(300.0, width=640, height=480, D=[-0.1, 0.01, 0.0, 0.0, 0.0])
        other.K[2], other.K[5] = 319.5, 239.5
        self.show(other)
        last = self.wait_for_report(self.diagnostics.OK, "not the map's")
        self.assertIn('fx 150 instead of 266.285', last.message)
        self.show(other)
        self.log.wait_for("The camera differs from the map's", DEADLINE_S)
        self.show(info())
        self.wait_for_report(self.diagnostics.OK, '266.3')
        self.assertEqual(len(self.logged("The camera differs from the map's")), 1)
        self.assertEqual(len(self.logged('The calibration of the camera changes: size 640 x 480')), 1)

    def test_5_a_file_needs_no_topic(self):
        by_file = fixture.Diagnostics('by_file')
        by_file.wait_for('camera', by_file.OK, DEADLINE_S)
        self.assertIn('calibration/campus.yaml', by_file.last_of('camera').message)
        self.assertEqual(self.publisher.get_num_connections(), 1)

    def test_6_where_the_robot_carries_it_is_known_by_the_frame_of_the_images(self):
        transform = TransformStamped(child_frame_id='stereo_left')
        transform.header.frame_id = 'base_link'
        transform.transform.translation.x = 0.25
        transform.transform.rotation.w = 1.0
        static = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        static.publish(TFMessage([transform]))
        images = rospy.Publisher('/camera/image_raw', Image, queue_size=1)
        fixture.wait_for(images.get_num_connections, DEADLINE_S, 'a subscriber of /camera/image_raw')
        image = Image(width=320, height=240, step=320, encoding='mono8', data=bytes(320 * 240))
        image.header.frame_id = 'stereo_left'

        def told():
            image.header.stamp = rospy.Time.now()
            images.publish(image)
            rospy.sleep(0.1)
            return [line for line in self.log.messages()
                    if 'Camera mounting from /tf_static: base_link to stereo_left' in line.msg and line.name == '/by_file']
        fixture.wait_for(told, DEADLINE_S, 'the mount of the camera')

    def test_7_odometry_is_subscribed_when_asked_for_and_refused_when_it_is_none(self):
        publisher = rospy.Publisher('/odom', Odometry, queue_size=10)
        fixture.wait_for(publisher.get_num_connections, DEADLINE_S, 'a subscriber of /odom')
        self.assertEqual(publisher.get_num_connections(), 1, 'the other node does without')
        good = Odometry(child_frame_id='base_link')
        good.header.frame_id, good.pose.pose.orientation.w = 'odom', 1.0
        good.header.stamp = rospy.Time.now()
        publisher.publish(good)
        good.pose.pose.position.x = float('nan')
        publisher.publish(good)
        self.log.wait_for('Odometry on /odom refused: its pose is not finite', DEADLINE_S)
        self.assertEqual(len(self.logged('Odometry on')), 1)


if __name__ == '__main__':
    rospy.init_node('camera_info_test')
    rostest.rosrun('visual_localization', 'camera_info_test', CameraInfoTest, sys.argv)
