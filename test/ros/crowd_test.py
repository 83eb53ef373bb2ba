#!/usr/bin/env python3
"""Many subscribers that come and go while images flow, and a second node of the same name."""
import os
import socket
import struct
import subprocess
import sys
import unittest
import xmlrpc.client

import roslib.packages
import rosgraph
import rosnode
import rospy
import rostest
from sensor_msgs.msg import Image

import localizer_fixture as fixture

DEADLINE_S = 30.0
BAG, MAP = sys.argv[1:3]
SUBSCRIBERS = int(os.environ.get('SUBSCRIBERS', 2000))
AT_A_TIME = 50


def start_node():
    return subprocess.Popen([roslib.packages.find_node('visual_localization', 'localizer_node')[0],
                             '__name:=localizer', 'image:=/stereo/left/image_raw'])


def subscription(topic):
    """A connection as a subscriber of images makes it, by http://wiki.ros.org/ROS/TCPROS."""
    api = xmlrpc.client.ServerProxy(rosnode.get_api_uri(rosgraph.Master('/crowd'), '/localizer'))
    _, _, (_, host, port) = api.requestTopic('/crowd', topic, [['TCPROS']])
    fields = ['callerid=/crowd', 'topic=' + topic, 'type=' + Image._type, 'md5sum=' + Image._md5sum]
    header = b''.join(struct.pack('<I', len(field)) + field.encode() for field in fields)
    return (host, port), struct.pack('<I', len(header)) + header


def end(node):
    node.kill()
    node.wait()


def answer_to(address, hello):
    """What the publisher says to a new subscriber."""
    with socket.create_connection(address, DEADLINE_S) as connection:
        connection.sendall(hello)
        return connection.recv(4096)


def entries(pid, what):
    return len(os.listdir('/proc/%d/%s' % (pid, what)))


class CrowdTest(unittest.TestCase):
    def setUp(self):
        self.images = iter(fixture.images_of(BAG))
        rospy.set_param('/localizer', {'map': MAP, 'image_transport': 'compressed'})
        self.node = start_node()
        self.addCleanup(end, self.node)
        self.localizer = fixture.Localizer()
        self.localizer.wait_until_up()
        self.camera = fixture.Camera(self.localizer)
        for _ in range(5):
            self.camera.show(next(self.images))

    def images_seen(self, recorders):
        def all_have():
            self.camera.show(next(self.images))
            return all(recorder.messages() for recorder in recorders)
        fixture.wait_for(all_have, DEADLINE_S, 'drawn images')

    def test_subscribers_that_come_and_go_leave_nothing_behind(self):
        topics = ['/localizer/matches', '/localizer/dashboard']
        watched = [fixture.Recorder(topic, Image) for topic in topics]
        self.images_seen(watched)  # drawing has begun: OpenCV has made its threads
        address, hellos = subscription(topics[0])[0], [subscription(topic)[1] for topic in topics]
        for hello in hellos:
            answer = answer_to(address, hello)
            self.assertIn(b'md5sum=', answer)
            self.assertNotIn(b'error=', answer)
        files, threads = entries(self.node.pid, 'fd'), entries(self.node.pid, 'task')
        before_mb = fixture.memory_mb('/localizer')
        for first in range(0, SUBSCRIBERS, AT_A_TIME):
            crowd = []
            for number in range(first, first + AT_A_TIME):
                crowd.append(socket.create_connection(address, DEADLINE_S))
                crowd[-1].sendall(hellos[number % 2] if number % 10 else b'\xff' * 8)  # some are no subscribers
            if first % (8 * AT_A_TIME) == 0:
                self.camera.show(next(self.images))
            for connection in crowd:
                connection.close()
        fixture.wait_for(lambda: entries(self.node.pid, 'fd') <= files, DEADLINE_S, 'the last one to leave')
        self.camera.show(next(self.images))
        after_mb = fixture.memory_mb('/localizer')
        rospy.loginfo('%d subscribers: memory %.0f MB before, %.0f after', SUBSCRIBERS, before_mb, after_mb)
        fixture.wait_for(lambda: entries(self.node.pid, 'task') <= threads, DEADLINE_S, 'the threads as before')
        self.assertLess(after_mb - before_mb, 30.0)

    def test_a_second_node_of_the_same_name_takes_over(self):
        second = start_node()
        self.addCleanup(end, second)
        self.assertEqual(self.node.wait(DEADLINE_S), 0, 'the first one ends, and not by a crash')
        self.localizer.status.clear()
        fixture.wait_for(lambda: self.localizer.status.is_connected(), DEADLINE_S, 'the second one')
        for _ in range(5):
            self.camera.show(next(self.images), insist=True)


if __name__ == '__main__':
    rospy.init_node('crowd_test')
    rostest.rosrun('visual_localization', 'crowd_test', CrowdTest, sys.argv)
