#!/usr/bin/env python3
"""A message of a few bytes whose length claims 4 GiB costs the node no memory, and no image after it."""
import socket
import struct
import threading
import unittest
import xmlrpc.server

import rosgraph
import rospy
import rostest
from sensor_msgs.msg import CompressedImage

import localizer_fixture as fixture

DEADLINE_S = 60.0


def sized(data):
    return struct.pack('<I', len(data)) + data


class Stranger:
    """A publisher of /camera/compressed by TCPROS, of one message that rospy would not send."""

    def __init__(self, claimed_bytes):
        self.payload = struct.pack('<III', 1, 1, 1) + sized(b'') + sized(b'jpeg') + struct.pack('<I', claimed_bytes)
        self.sent = threading.Event()
        self.data = socket.create_server(('127.0.0.1', 0))
        self.calls = xmlrpc.server.SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
        self.calls.register_function(
            lambda *_: [1, '', ['TCPROS', '127.0.0.1', self.data.getsockname()[1]]], 'requestTopic')
        self.calls.register_function(lambda *_: [1, '', 0], 'publisherUpdate')
        for run in (self.calls.serve_forever, self.serve):
            threading.Thread(target=run, daemon=True).start()
        rosgraph.Master('/stranger').handle.registerPublisher(
            '/stranger', '/camera/compressed', CompressedImage._type,
            'http://127.0.0.1:%d/' % self.calls.server_address[1])

    def serve(self):
        connection, _ = self.data.accept()
        connection.recv(struct.unpack('<I', connection.recv(4))[0])
        header = {'callerid': '/stranger', 'type': CompressedImage._type, 'md5sum': CompressedImage._md5sum,
                  'message_definition': CompressedImage._full_text}
        connection.sendall(sized(b''.join(sized(('%s=%s' % field).encode()) for field in header.items())))
        connection.sendall(sized(self.payload))
        self.sent.set()
        connection.recv(1)  # until the node goes


class MemoryLimitTest(unittest.TestCase):
    def test_a_length_of_four_gigabytes(self):
        localizer = fixture.Localizer()
        localizer.wait_until_up()
        camera = fixture.Camera(localizer, '/camera/compressed')
        images = fixture.images_of(rospy.get_param('~bag'), count=4)
        camera.show(images[0], insist=True)
        stranger = Stranger(2 ** 32 - 1)
        self.assertTrue(stranger.sent.wait(DEADLINE_S))
        for image in images[1:]:
            camera.show(image, insist=True)
        self.assertLess(fixture.memory_mb('/localizer'), 500)


if __name__ == '__main__':
    rospy.init_node('memory_limit_test')
    rostest.rosrun('visual_localization', 'memory_limit_test', MemoryLimitTest)
