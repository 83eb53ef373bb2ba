#!/usr/bin/env python3
"""Nodelets come and go in one manager while images arrive, and the manager lives on."""
import itertools
import sys
import threading
import unittest

import rospy
import rostest
from dynamic_reconfigure.client import Client
from nav_msgs.msg import Path
from nodelet.srv import NodeletList, NodeletLoad, NodeletLoadRequest, NodeletUnload
from sensor_msgs.msg import CompressedImage

import localizer_fixture as fixture

TYPE = 'visual_localization/LocalizerNodelet'
TIMES = 10
RATE_HZ = 25.0


class Camera:
    def __init__(self, images):
        self._publisher = rospy.Publisher('/camera/compressed', CompressedImage, queue_size=1)
        self._images = itertools.cycle(images)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._ended.wait(1.0 / RATE_HZ):
            image = next(self._images)
            image.header.stamp = rospy.Time.now()
            self._publisher.publish(image)

    def stop(self):
        self._ended.set()
        self._thread.join()


class UnloadTest(unittest.TestCase):
    def setUp(self):
        self.load_service = rospy.ServiceProxy('/manager/load_nodelet', NodeletLoad)
        self.unload_service = rospy.ServiceProxy('/manager/unload_nodelet', NodeletUnload)
        self.list_service = rospy.ServiceProxy('/manager/list', NodeletList)
        self.load_service.wait_for_service(30.0)
        self.camera = Camera(fixture.images_of(rospy.get_param('~bag'), count=40))
        self.addCleanup(self.camera.stop)

    def load(self, name, **parameters):
        parameters = dict({'map': rospy.get_param('~map'), 'image_transport': 'compressed'}, **parameters)
        rospy.set_param(name, parameters)
        self.addCleanup(rospy.delete_param, name)
        try:
            return self.load_service(NodeletLoadRequest(
                name=name, type=TYPE, remap_source_args=['image'], remap_target_args=['/camera'])).success
        except rospy.ServiceException:  # how the manager says no
            return False

    def unload(self, name):
        self.assertTrue(self.unload_service(name).success)

    def wait_until_it_works(self, name):
        localizer = fixture.Localizer(name)
        fixture.wait_for(lambda: localizer.counts()[0] >= 2, 60.0, 'two images processed by ' + name)

    def test_ten_times(self):
        for i in range(TIMES):
            name = '/localizer_%d' % i
            self.assertTrue(self.load(name))
            self.wait_until_it_works(name)
            self.unload(name)
        self.assertEqual(self.list_service().nodelets, [])

    def test_two_at_once(self):
        for name in ('/left', '/right'):
            self.assertTrue(self.load(name))
        for name in ('/left', '/right'):
            self.wait_until_it_works(name)
        for name in ('/left', '/right'):
            self.unload(name)

    def test_two_maps_in_one_manager(self):
        """Each has its own map, parameters and diagnostics."""
        paths = {'/fine': fixture.Recorder('/fine/map_path', Path), '/coarse': fixture.Recorder('/coarse/map_path', Path)}
        self.assertTrue(self.load('/fine'))
        self.assertTrue(self.load('/coarse', map=rospy.get_param('~coarse_map')))
        for name in paths:
            self.wait_until_it_works(name)
        lengths = {name: len(fixture.wait_for(path.last, 30.0, 'the map of ' + name).poses)
                   for name, path in paths.items()}
        self.assertEqual(lengths, {'/fine': 404, '/coarse': 59})
        fine, coarse = Client('/fine', timeout=30.0), Client('/coarse', timeout=30.0)
        fine.update_configuration({'dpso/particles': 33})
        self.assertEqual(coarse.update_configuration({})['dpso/particles'], 80)
        self.assertEqual(rospy.get_param('/coarse/dpso/particles'), 80)
        for name in paths:
            self.unload(name)

    def test_a_bad_parameter_fails_the_nodelet_and_not_the_manager(self):
        self.assertFalse(self.load('/bad', tf_mode='sideways'))
        self.assertFalse(self.load('/mapless', map='/does/not/exist.map'))
        self.assertTrue(self.load('/good'))
        self.wait_until_it_works('/good')
        self.unload('/good')


if __name__ == '__main__':
    rospy.init_node('unload_test')
    rostest.rosrun('visual_localization', 'unload_test', UnloadTest, sys.argv)
