#!/usr/bin/env python3
"""No image and no map makes the node take more resident memory than doc/faults.md says."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy as np
import roslib.packages
import rospy
import rostest
from sensor_msgs.msg import CompressedImage

import localizer_fixture as fixture
from visual_localization.srv import LoadMap

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / 'support'))
from memory_bounds import WITHOUT_THREADS_OF_BLAS, localizer_bound, mib, peak_mib, with_size  # noqa: E402

LOCALIZER = roslib.packages.find_node('visual_localization', 'localizer_node')[0]
DEADLINE_S = 60.0

THREADS = 14
MAP_PIXELS = 320 * 240


def compressed(data):
    message = CompressedImage(format='png', data=data)
    message.header.stamp = rospy.Time.now()
    return message


class MemoryTest(unittest.TestCase):
    def start(self, map_file):
        self.bound_mib = localizer_bound(MAP_PIXELS, mib(os.path.getsize(map_file)), THREADS)
        process = subprocess.Popen(
            [LOCALIZER, '__name:=localizer', '_map:=' + map_file, '_image_transport:=compressed',
             'image:=/stereo/left/image_raw'], env=WITHOUT_THREADS_OF_BLAS)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_hostile_images_and_maps(self):
        map_file = rospy.get_param('~map')
        localizer = fixture.Localizer()
        process = self.start(map_file)
        localizer.wait_until_up()
        camera = fixture.Camera(localizer)
        load_map = rospy.ServiceProxy('/localizer/load_map', LoadMap)
        load_map.wait_for_service(DEADLINE_S)

        white = cv2.imencode('.png', np.full((4096, 4096), 255, np.uint8))[1].tobytes()
        small = cv2.imencode('.jpg', np.zeros((240, 320), np.uint8))[1].tobytes()
        bombs = [with_size(small, side) for side in (60000, 4096)]
        before = sum(localizer.counts())
        for data in (white, *bombs, b'', white):
            camera.publish(compressed(data))
            rospy.sleep(1.0)
        with tempfile.TemporaryDirectory() as folder:
            wrong = pathlib.Path(folder) / 'wrong.map'
            whole = pathlib.Path(map_file).read_bytes()
            for place in range(20, len(whole), len(whole) // 5):
                wrong.write_bytes(whole[:place] + 64 * b'\xff' + whole[place + 64:])
                answer = load_map(str(wrong))
                self.assertNotIn('memory', answer.message)
            self.assertTrue(load_map(map_file).success)

        sources = [camera.show(image, insist=True).source_name
                   for image in fixture.images_of(rospy.get_param('~bag'), count=5)]
        self.assertIn('METRIC', sources)
        self.assertGreaterEqual(sum(localizer.counts()) - before, 5)
        self.assertIsNone(process.poll())
        self.assertLessEqual(len(os.listdir('/proc/%d/task' % process.pid)), THREADS)
        took_mib = peak_mib(process.pid)
        print('bound %.0f MiB, took %.0f MiB' % (self.bound_mib, took_mib))
        self.assertTrue(0.0 < took_mib <= self.bound_mib, took_mib)


if __name__ == '__main__':
    rospy.init_node('memory_test')
    rostest.rosrun('visual_localization', 'memory_test', MemoryTest)
