#!/usr/bin/env python3
"""Whatever arrives, the node stays alive, keeps its map and says what it refused."""
import sys
import unittest

import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CompressedImage, Image

import localizer_fixture as fixture
from visual_localization.srv import LoadMap

DEADLINE_S = 30.0
NAN = float('nan')


def grey(width=320, height=240):
    image = Image(width=width, height=height, step=width, encoding='mono8')
    image.data = bytes(bytearray((7 * i) % 251 for i in range(width * height)))
    return image


def spoilt(**changes):
    image = grey()
    for name, value in changes.items():
        setattr(image, name, value)
    return image


BAD_IMAGES = [
    Image(),
    spoilt(width=0),
    spoilt(height=0),
    spoilt(encoding='smell8'),
    spoilt(encoding=''),
    spoilt(encoding='bgr8'),
    spoilt(step=1),
    spoilt(step=4294967295),
    spoilt(height=4294967295),
    spoilt(data=b''),
    spoilt(data=b'\x00' * 100),
]


def pose(x=0.0, frame='map', variance=4.0):
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    message.pose.pose.position.x = x
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance[0] = message.pose.covariance[7] = variance
    return message


class InputsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.images = rospy.Publisher('/camera', Image, queue_size=1)
        cls.jpegs = rospy.Publisher('/camera/compressed', CompressedImage, queue_size=1)
        cls.initial_pose = rospy.Publisher('/initialpose', PoseWithCovarianceStamped, queue_size=10)
        cls.raw = fixture.Localizer('/raw')
        cls.compressed = fixture.Localizer('/compressed')
        for localizer in (cls.raw, cls.compressed):
            localizer.wait_until_up()
        for publisher in (cls.images, cls.jpegs, cls.initial_pose):
            fixture.wait_for(publisher.get_num_connections, DEADLINE_S, 'a subscriber')
        cls.good_jpeg = fixture.images_of(rospy.get_param('~bag'), count=1)[0]

    def send_until_processed(self, publisher, image, localizer):
        """The status, and with it the counts, comes with the next image that is good."""
        before = localizer.counts()[0]

        def processed():
            image.header.stamp = rospy.Time.now()
            publisher.publish(image)
            rospy.sleep(0.1)
            return localizer.counts()[0] > before
        fixture.wait_for(processed, DEADLINE_S, 'a good image to be processed')
        return localizer.counts()[1]

    def check_refused(self, publisher, good, bad_images, localizer):
        for bad in bad_images:
            before = self.send_until_processed(publisher, good, localizer)

            def refused(message=bad, count=before):
                publisher.publish(message)
                rospy.sleep(0.1)
                return self.send_until_processed(publisher, good, localizer) > count
            fixture.wait_for(refused, DEADLINE_S, 'the refusal of a bad image')

    def test_bad_images(self):
        self.check_refused(self.images, grey(), BAD_IMAGES, self.raw)

    def test_bad_jpegs(self):
        whole = self.good_jpeg.data
        bad = [b'', b'no picture', whole[:len(whole) // 2], whole[:3], b'\xff\xd8\xff\xd9']
        self.check_refused(self.jpegs, self.good_jpeg, [CompressedImage(format='jpeg', data=data) for data in bad],
                           self.compressed)

    def test_other_sizes_and_stamps_are_no_error(self):
        refused = self.send_until_processed(self.images, grey(640, 480), self.raw)
        for stamp in (rospy.Time(0), rospy.Time(1), rospy.Time(5)):
            image = grey()
            image.header.stamp = stamp
            before = self.raw.counts()[0]

            def processed(message=image, count=before):
                self.images.publish(message)
                rospy.sleep(0.1)
                return self.raw.counts()[0] > count
            fixture.wait_for(processed, DEADLINE_S, 'an image with an odd stamp')
        self.assertEqual(self.raw.counts()[1], refused)

    def test_stamps_in_the_future_are_refused(self):
        future = [grey(), grey()]
        future[0].header.stamp = rospy.Time(4294967295, 999999999)
        future[1].header.stamp = rospy.Time.now() + rospy.Duration(2 * 86400)
        self.check_refused(self.images, grey(), future, self.raw)

    def test_bad_initial_poses(self):
        asymmetric = pose()
        asymmetric.pose.covariance[1] = 3.0
        bad_poses = [pose(x=NAN), pose(x=float('inf')), pose(variance=NAN), pose(variance=-1.0), pose(frame='odom'),
                     pose(frame=''), pose(x=1e300), asymmetric]
        log = fixture.Recorder('/rosout', Log)
        fixture.wait_for(log.is_connected, DEADLINE_S, 'the log')
        for bad in bad_poses:
            self.initial_pose.publish(bad)
        fixture.wait_for(lambda: any('Initial pose refused' in line.msg for line in log.messages()), DEADLINE_S,
                         'the reason in the log')
        self.send_until_processed(self.images, grey(), self.raw)

    def test_garbage_for_a_map(self):
        load_map = rospy.ServiceProxy('/raw/load_map', LoadMap)
        load_map.wait_for_service(DEADLINE_S)
        images = load_map(rospy.get_param('~map')).images
        self.assertGreater(images, 0)
        for path in ('', '/does/not/exist.map', '/etc', __file__, rospy.get_param('~bag')):
            answer = load_map(path)
            self.assertFalse(answer.success)
            self.assertEqual(answer.images, images)
            self.assertNotIn('\n', answer.message)
            self.assertTrue(answer.message)
        self.send_until_processed(self.images, grey(), self.raw)


if __name__ == '__main__':
    rospy.init_node('inputs_test')
    rostest.rosrun('visual_localization', 'inputs_test', InputsTest, sys.argv)
