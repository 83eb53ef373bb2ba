#!/usr/bin/env python3
"""A roscore that dies and comes back. It only introduces nodes to each other: connections that exist live on. This test
has a roscore of its own for that."""
import itertools
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import unittest

import roslib.packages
import rospy
import rostest
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest
from dynamic_reconfigure.msg import IntParameter

import localizer_fixture as fixture

DEADLINE_S = 30.0
BAG, MAP = sys.argv[1:3]


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def stamped_now(images):
    for image in images:
        image.header.stamp = rospy.Time.now()
        yield image


class Master:
    """A master that can be killed and started again at the same address."""

    def __init__(self, port):
        self._port = port
        self.start()

    def start(self):
        self._process = subprocess.Popen(['rosmaster', '--core', '-p', str(self._port)], stdout=subprocess.DEVNULL,
                                         stderr=subprocess.DEVNULL)

        def answers():
            with socket.socket() as probe:
                return probe.connect_ex(('127.0.0.1', self._port)) == 0
        fixture.wait_for(answers, DEADLINE_S, 'the master')

    def kill(self):
        self._process.kill()
        self._process.wait()


class Repeated:
    """Does something again and again in a thread of its own until it is ended."""

    def __init__(self, action):
        self.count = 0
        self.error = None
        self._action = action
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._ended.is_set() and self.error is None:
            try:
                self._action()
                self.count += 1
            except Exception as error:
                self.error = error

    def end(self):
        """False when it does not come back."""
        self._ended.set()
        self._thread.join(DEADLINE_S)
        return not self._thread.is_alive()


class MasterTest(unittest.TestCase):
    """One node through all of it, in this order."""

    @classmethod
    def setUpClass(cls):
        cls.images = stamped_now(itertools.cycle(fixture.images_of(BAG, count=60)))
        rospy.set_param('/localizer', {'map': MAP, 'image_transport': 'compressed'})
        cls.node = subprocess.Popen([roslib.packages.find_node('visual_localization', 'localizer_node')[0],
                                     '__name:=localizer', 'image:=/stereo/left/image_raw'])
        cls.addClassCleanup(cls.node.wait)
        cls.addClassCleanup(cls.node.kill)
        cls.localizer = fixture.Localizer()
        cls.localizer.wait_until_up()
        cls.camera = fixture.Camera(cls.localizer)
        rospy.wait_for_service('/localizer/set_parameters', DEADLINE_S)
        # Persistent, since nobody can be asked for the address while there is no master.
        cls.set_parameters = rospy.ServiceProxy('/localizer/set_parameters', Reconfigure, persistent=True)

    def set_particles(self, count):
        """The number of particles that holds afterwards, and how long the answer took."""
        request = ReconfigureRequest()
        request.config.ints.append(IntParameter('dpso/particles', count))
        begin = time.monotonic()
        answer = {item.name: item.value for item in self.set_parameters(request).config.ints}
        return answer['dpso/particles'], time.monotonic() - begin

    def show(self, count):
        for _ in range(count):
            self.camera.show(next(self.images))

    def test_1_images_flow_without_and_with_a_new_master(self):
        self.show(5)
        self.assertEqual(self.set_particles(81)[0], 81)
        master.kill()
        self.show(10)
        particles, seconds = self.set_particles(82)
        print('without a master parameters are set after %.2f s' % seconds)
        self.assertEqual(particles, 82)
        self.assertLess(seconds, 5.0)
        master.start()
        self.show(10)
        self.assertEqual(self.set_particles(83)[0], 83)
        self.assertEqual(rospy.get_param('/localizer/dpso/particles'), 83)

    def test_2_killed_under_load(self):
        def publish():
            self.camera.publish(next(self.images))
            time.sleep(0.02)

        numbers = itertools.cycle(range(60, 100))

        def set_particles():
            asked = next(numbers)
            particles, _ = self.set_particles(asked)
            if particles != asked:
                raise AssertionError('%d particles instead of %d' % (particles, asked))

        # Images come faster than one by one, and parameters change between them.
        load = images, settings = Repeated(publish), Repeated(set_particles)

        def goes_on(answered, set_before):
            """10 more images are answered, and parameters set by a call that began after the change."""
            return any(one.error for one in load) or (
                len(self.localizer.status.messages()) >= answered + 10 and settings.count >= set_before + 2)

        try:
            for _ in range(5):
                for change in (master.kill, master.start):
                    change()
                    before = len(self.localizer.status.messages()), settings.count
                    fixture.wait_for(lambda: goes_on(*before), DEADLINE_S, 'answers after ' + change.__name__)
                    self.assertEqual([one.error for one in load], [None, None])
        finally:
            ended = [one.end() for one in load]
        self.assertEqual(ended, [True, True])
        self.assertEqual([one.error for one in load], [None, None])
        self.assertIsNone(self.node.poll())
        print('5 masters killed while %d images were published and parameters set %d times'
              % tuple(one.count for one in load))

    def test_3_ends_without_a_master(self):
        master.kill()
        self.show(5)
        begin = time.monotonic()
        self.node.send_signal(signal.SIGINT)
        self.assertEqual(self.node.wait(DEADLINE_S), 0)
        print('without a master the node ends after %.2f s' % (time.monotonic() - begin))


if __name__ == '__main__':
    port = free_port()
    os.environ['ROS_MASTER_URI'] = 'http://127.0.0.1:%d' % port
    master = Master(port)
    try:
        rospy.init_node('master_test', disable_signals=True)
        rostest.rosrun('visual_localization', 'master_test', MasterTest, sys.argv)
    finally:
        master.kill()
