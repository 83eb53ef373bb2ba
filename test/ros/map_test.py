#!/usr/bin/env python3
"""A node without a map says so, and starts where it was told once it gets one."""
import sys
import unittest

import rospy
import rostest
from geometry_msgs.msg import Point, PoseArray, PoseWithCovarianceStamped
from sensor_msgs.msg import CompressedImage

import localizer_fixture as fixture
from visual_localization.msg import LocalizationStatus
from visual_localization.srv import FromLL, LoadMap, Relocalize, RelocalizeRequest, ToLL

DEADLINE_S = 30.0
GUESS_STD_M = 0.5
NEAR_M = 15.0


class MapTest(unittest.TestCase):
    def setUp(self):
        self.camera = rospy.Publisher('/stereo/left/image_raw/compressed', CompressedImage, queue_size=1)
        self.initial_pose = rospy.Publisher('/initialpose', PoseWithCovarianceStamped, queue_size=1)
        self.diagnostics = fixture.Diagnostics('localizer')
        self.particles = fixture.Recorder('/localizer/particles', PoseArray)
        self.localizer = fixture.Localizer()
        self.localizer.wait_until_up()
        self.load_map = rospy.ServiceProxy('/localizer/load_map', LoadMap)
        self.relocalize = rospy.ServiceProxy('/localizer/relocalize', Relocalize)
        self.from_ll = rospy.ServiceProxy('/localizer/from_ll', FromLL)
        self.to_ll = rospy.ServiceProxy('/localizer/to_ll', ToLL)
        for service in (self.load_map, self.relocalize, self.from_ll, self.to_ll):
            service.wait_for_service(DEADLINE_S)
        for publisher in (self.camera, self.initial_pose):
            fixture.wait_for(publisher.get_num_connections, DEADLINE_S, 'a subscriber')

    def test_life_without_and_with_a_map(self):
        self.check_no_map()
        self.give_initial_pose(x=30.0, y=20.0)
        self.assertGreater(self.load_map(rospy.get_param('~map')).images, 0)
        self.check_starts_near(x=30.0, y=20.0)
        self.check_geodetic()

    def check_no_map(self):
        self.localizer.status.clear()
        fixture.wait_for(lambda: len(self.localizer.status.messages()) >= 3, DEADLINE_S, 'three reports of NO_MAP')
        self.assertTrue(all(s.state == LocalizationStatus.NO_MAP for s in self.localizer.status.messages()))
        answer = self.relocalize(RelocalizeRequest(use_centre=False))
        self.assertFalse(answer.success)
        self.assertIn('map', answer.message)
        self.assertFalse(self.load_map('/does/not/exist.map').success)
        self.assertIn('/nowhere/campus.map', self.load_map('nowhere/campus.map').message, 'where it looked')
        self.assertEqual(self.from_ll(48.5, 9.0).message, 'no map is loaded')
        self.assertEqual(self.to_ll(Point(1.0, 2.0, 0.0)).message, 'no map is loaded')
        self.check_images_without_a_map_are_counted()

    def check_images_without_a_map_are_counted(self):
        def counted():
            return self.diagnostics.last_of('images') and int(self.diagnostics.value('images', 'Without a map')) == 1
        self.camera.publish(fixture.images_of(rospy.get_param('~bag'), count=1)[0])
        fixture.wait_for(counted, DEADLINE_S, 'an image to be counted')
        self.assertEqual(int(self.diagnostics.value('images', 'Received')), 1)
        self.assertEqual(self.localizer.status.last().images_refused, 0)

    def check_geodetic(self):
        origin = self.to_ll(Point(0.0, 0.0, 0.0))
        self.assertTrue(origin.success)
        north = self.to_ll(Point(0.0, 100.0, 0.0))
        self.assertAlmostEqual(fixture.distance_m(origin, north), 100.0, delta=0.5)
        self.assertAlmostEqual(north.longitude, origin.longitude, places=9)
        back = self.from_ll(north.latitude, north.longitude)
        self.assertTrue(back.success)
        self.assertAlmostEqual(back.map_point.x, 0.0, places=6)
        self.assertAlmostEqual(back.map_point.y, 100.0, places=6)
        for latitude, longitude, reason in ((91.0, 9.0, 'latitude'), (float('nan'), 9.0, 'latitude'),
                                            (48.0, 200.0, 'longitude'), (-33.0, 151.0, '1000 km')):
            answer = self.from_ll(latitude, longitude)
            self.assertFalse(answer.success)
            self.assertIn(reason, answer.message)
        for point in (Point(float('inf'), 0.0, 0.0), Point(0.0, float('nan'), 0.0), Point(2e6, 0.0, 0.0)):
            self.assertFalse(self.to_ll(point).success)

    def give_initial_pose(self, x, y):
        pose = PoseWithCovarianceStamped()
        pose.header.frame_id = 'map'
        pose.pose.pose.position.x = x
        pose.pose.pose.position.y = y
        pose.pose.pose.orientation.w = 1.0
        pose.pose.covariance[0] = pose.pose.covariance[7] = GUESS_STD_M ** 2
        self.initial_pose.publish(pose)
        rospy.sleep(1.0)  # nothing tells that it has arrived

    def check_starts_near(self, x, y):
        image = fixture.images_of(rospy.get_param('~bag'), count=1)[0]

        def first_cloud():
            self.camera.publish(image)
            rospy.sleep(0.1)
            return self.particles.messages()
        cloud = fixture.wait_for(first_cloud, DEADLINE_S, 'the first particles')[0]
        near = [p for p in cloud.poses if abs(p.position.x - x) < NEAR_M and abs(p.position.y - y) < NEAR_M]
        self.assertGreater(len(near), 0.7 * len(cloud.poses))


if __name__ == '__main__':
    rospy.init_node('map_test')
    rostest.rosrun('visual_localization', 'map_test', MapTest, sys.argv)
