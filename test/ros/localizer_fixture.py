"""What the tests of the running node share: waiting with a deadline, the truth, distances."""
import math
import os
import subprocess
import threading
import time
import xmlrpc.client

import numpy as np
import rosbag
import rosgraph
import rosnode
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log
from rosunit import xmlrunner
from sensor_msgs.msg import CompressedImage, Image, NavSatFix

from visual_localization.msg import LocalizationStatus

EARTH_RADIUS_M = 6371000.0
TRUTH_TOPIC = '/ground_truth/fix'
IMAGE_TOPIC = '/stereo/left/image_raw/compressed'
SLOWNESS = int(os.environ.get('VISUAL_LOCALIZATION_TEST_SLOWNESS', '1'))  # of this build


def _fail_skipped(result, test, reason):
    result.addFailure(test, (AssertionError, AssertionError('skipped: ' + reason), None))


xmlrunner._XMLTestResult.addSkip = _fail_skipped  # rosunit would report a skipped test as passed


def value_within(timeout_s, condition):
    """Returns the first true value of `condition()`; None after `timeout_s` of wall time."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    return None


def wait_for(condition, timeout_s, what):
    """Returns the first true value of `condition()`; fails after `timeout_s` of wall time."""
    value = value_within(timeout_s, condition)
    if value is None:
        raise AssertionError('waited %.0f s in vain for %s' % (timeout_s, what))
    return value


def others(topic):
    """Connections of a publisher or subscriber to other nodes. A test that sends and records one topic hears itself."""
    myself = (rospy.get_name(), rospy.get_node_uri())
    return [connection for connection in topic.impl.get_stats_info() if connection[1] not in myself]


def distance_m(a, b):
    north = math.radians(a.latitude - b.latitude)
    east = math.radians(a.longitude - b.longitude) * math.cos(math.radians(b.latitude))
    return EARTH_RADIUS_M * math.hypot(north, east)


class Recorder:
    def __init__(self, topic, message_type):
        self._lock = threading.Lock()
        self._messages = []
        self._subscriber = rospy.Subscriber(topic, message_type, self._add, queue_size=1000)

    def _add(self, message):
        with self._lock:
            self._messages.append(message)

    def messages(self):
        with self._lock:
            return list(self._messages)

    def last(self):
        with self._lock:
            return self._messages[-1] if self._messages else None

    def clear(self):
        with self._lock:
            self._messages = []

    def is_connected(self):
        return bool(others(self._subscriber))


class LogRecorder(Recorder):
    def __init__(self):
        super().__init__('/rosout', Log)

    def wait_for(self, text, timeout_s):
        wait_for(lambda: any(text in line.msg for line in self.messages()), timeout_s, '"%s" in the log' % text)


class Diagnostics(Recorder):
    """What one node reports of its parts."""
    OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR

    def __init__(self, node):
        self._node = node
        super().__init__('/diagnostics', DiagnosticArray)

    def last_of(self, part):
        name = '%s: %s' % (self._node, part)
        found = [status for array in self.messages() for status in array.status if status.name == name]
        return found[-1] if found else None

    def wait_for(self, part, level, timeout_s):
        """The message of the next report with this level."""
        def reached():
            last = self.last_of(part)
            return last if last is not None and last.level == level else None
        self.clear()
        return wait_for(reached, timeout_s, 'level %r of %s' % (level, part)).message

    def value(self, part, key):
        last = self.last_of(part)
        return {item.key: item.value for item in last.values}[key] if last else 'nan'


class Localizer:
    """The node under test as its users see it."""

    def __init__(self, name='/localizer'):
        self.status = Recorder(name + '/status', LocalizationStatus)
        self.fix = Recorder(name + '/fix', NavSatFix)

    def wait_until_up(self, timeout_s=60.0):
        wait_for(lambda: self.status.is_connected() and self.fix.is_connected(), timeout_s, 'the localizer')

    def wait_for_state(self, state, timeout_s):
        def reached():
            last = self.status.last()
            return last is not None and last.state == state
        wait_for(reached, timeout_s, 'state %d' % state)

    def counts(self):
        last = self.status.last()
        return (last.images_processed, last.images_refused) if last else (0, 0)


class Camera:
    """Shows images to a localizer one by one, as fast as it takes them."""

    def __init__(self, localizer, topic=IMAGE_TOPIC, message_type=CompressedImage):
        self._localizer = localizer
        self._publisher = rospy.Publisher(topic, message_type, queue_size=10)
        wait_for(self._publisher.get_num_connections, 60.0, 'a subscriber of ' + topic)

    def publish(self, image):
        self._publisher.publish(image)

    def show(self, image, timeout_s=30.0, insist=False):
        """The status that the image led to. `insist`: shows it again and again, should it be dropped."""
        def answer():
            if insist:
                self.publish(image)
                time.sleep(0.2)
            return [s for s in self._localizer.status.messages()
                    if s.header.stamp == image.header.stamp and s.images_processed > before]
        before = self._localizer.counts()[0]
        self.publish(image)
        return wait_for(answer, timeout_s, 'the answer to an image')[0]


def wait_for_silence(localizer, seconds=1.0):
    """Until no more image is answered: those that were sent before a bag was stopped may still be on their way."""
    def silent():
        before = localizer.counts()
        time.sleep(seconds)
        return localizer.counts() == before
    wait_for(silent, 60.0, 'the last images of the bag')


def memory_mb(node):
    _, _, pid = xmlrpc.client.ServerProxy(rosnode.get_api_uri(rosgraph.Master('/test'), node)).getPid('/test')
    with open('/proc/%d/status' % pid) as status:
        return [float(line.split()[1]) / 1024.0 for line in status if line.startswith('VmRSS')][0]


def truth_of(bag_path):
    """Exact fixes of a bag by stamp."""
    with rosbag.Bag(bag_path) as bag:
        return {fix.header.stamp.to_nsec(): fix for _, fix, _ in bag.read_messages(topics=[TRUTH_TOPIC])}


def images_of(bag_path, first=0, count=None):
    """Compressed images of a bag in order."""
    with rosbag.Bag(bag_path) as bag:
        images = [image for _, image, _ in bag.read_messages(topics=[IMAGE_TOPIC])]
    return images[first:] if count is None else images[first:first + count]


def image_of(pixels, encoding, stamp):
    pixels = np.ascontiguousarray(pixels)
    image = Image(height=pixels.shape[0], width=pixels.shape[1], step=pixels.strides[0], encoding=encoding)
    image.header.stamp = stamp
    image.data = pixels.tobytes()
    return image


def errors_m(fixes, truth):
    """Distance of each fix from the truth at the same stamp."""
    return [distance_m(fix, truth[fix.header.stamp.to_nsec()]) for fix in fixes if fix.header.stamp.to_nsec() in truth]


def share_below(errors, limit_m):
    return sum(error < limit_m for error in errors) / float(len(errors)) if errors else 0.0


class Player:
    def __init__(self, bag_path, rate, start_s=0.0, duration_s=None):
        command = ['rosbag', 'play', '--quiet', '-d', '1', '-r', str(rate), '-s', str(start_s), bag_path]
        if duration_s is not None:
            command[3:3] = ['-u', str(duration_s)]
        self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, env=dict(os.environ))

    def ended(self):
        return self._process.poll() is not None

    def stop(self):
        if not self.ended():
            self._process.terminate()
        self._process.wait()
