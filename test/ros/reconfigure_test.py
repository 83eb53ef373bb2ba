#!/usr/bin/env python3
"""Parameters while the node runs: by the tools of dynamic_reconfigure, without losing the track."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rospy
import rostest
import yaml
from dynamic_reconfigure.client import Client
from rosgraph_msgs.msg import Log

import localizer_fixture as fixture
from visual_localization.msg import LocalizationStatus, Swarm

DEADLINE_S = 30.0
NEAR_M = 8.0
DYNPARAM = ['rosrun', 'dynamic_reconfigure', 'dynparam']


def run(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
                          timeout=60, check=True).stdout


def make_plain(path):
    """The dump of dynparam without Python objects, which Debian 11's dynparam writes but does not read."""
    with open(path, encoding='utf-8') as dump:
        values = yaml.unsafe_load(dump)
    with open(path, 'w', encoding='utf-8') as dump:
        yaml.safe_dump(json.loads(json.dumps(values)), dump)


def values_of(config):
    """Without the tree of groups, which repeats them."""
    return {name: value for name, value in config.items() if name != 'groups'}


class ReconfigureTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        bag = rospy.get_param('~bag')
        cls.truth = fixture.truth_of(bag)
        cls.images = iter(fixture.images_of(bag))
        cls.log = fixture.Recorder('/rosout', Log)
        cls.swarm = fixture.Recorder('/localizer/swarm', Swarm)
        cls.localizer = fixture.Localizer()
        cls.localizer.wait_until_up()
        cls.camera = fixture.Camera(cls.localizer)
        cls.client = Client('/localizer', timeout=DEADLINE_S)
        fixture.wait_for(lambda: cls.log.is_connected() and cls.swarm.is_connected(), DEADLINE_S, 'all topics')

    def drive(self, count):
        """The states of the next images and the largest error of their fixes, metres."""
        statuses = [self.camera.show(next(self.images)) for _ in range(count)]
        stamps = {status.header.stamp for status in statuses}
        fixture.wait_for(lambda: stamps <= {fix.header.stamp for fix in self.localizer.fix.messages()}, DEADLINE_S,
                         'the fixes')
        fixes = [fix for fix in self.localizer.fix.messages() if fix.header.stamp in stamps]
        return {status.state for status in statuses}, max(fixture.errors_m(fixes, self.truth))

    def values(self):
        """Those that hold: the answer to a request that changes nothing. The client's own copy may be late."""
        return values_of(self.client.update_configuration({}))

    def particles(self):
        return len(fixture.wait_for(self.swarm.last, DEADLINE_S, 'the swarm').particles)

    def test_1_the_track_goes_on_while_everything_changes(self):
        for _ in range(12):
            if self.drive(5)[0] == {LocalizationStatus.TRACKING}:
                break
        for change in ({'dpso/particles': 120}, {'tracker': 'pf_gaussian'}, {'tracker': 'pf_linear'},
                       {'features': 'hybrid'}, {'features': 'sift', 'tracker': 'dpso'}, {'dpso/particles': 80},
                       {'recovery': 'paper', 'similarity/sift_recognised': 0.04}):
            answer = self.client.update_configuration(dict(change))
            self.assertEqual({name: answer[name] for name in change}, change)
            states, error_m = self.drive(4)
            print('%s: largest error %.1f m' % (change, error_m))
            self.assertEqual(states, {LocalizationStatus.TRACKING}, change)
            self.assertLess(error_m, NEAR_M, change)
        self.assertEqual(self.particles(), 80)
        self.assertEqual(rospy.get_param('/localizer/recovery'), 'paper')
        self.client.update_configuration({'recovery': 'guided', 'similarity/sift_recognised': 0.05})

    def assert_refused(self, change, *words):
        before = self.values()
        on_server = rospy.get_param('/localizer')
        self.log.clear()
        answer = self.client.update_configuration(dict(change))
        self.assertEqual(values_of(answer), before)

        def warnings():
            return [line.msg for line in self.log.messages() if 'Parameters: not changed' in line.msg]
        warning = fixture.wait_for(warnings, DEADLINE_S, 'the warning')[0]
        for word in words:
            self.assertIn(word, warning)
        self.assertEqual(len(warnings()), 1)
        self.assertEqual(rospy.get_param('/localizer'), on_server)

    def test_2_what_is_not_allowed_changes_nothing(self):
        self.assert_refused({'dpso/particles': 1}, "'dpso/particles' = 1", '[2, 100000]')
        self.assert_refused({'dpso/phi2': float('nan')}, "'dpso/phi2' = nan", '[0, 4]')
        self.assert_refused({'tracker': 'crystal_ball', 'dpso/phi2': 0.5}, "'tracker' = crystal_ball", 'pf_linear')
        self.assert_refused({'dpso/v0': 0.5}, "'dpso/v0' = 0.5", "'dpso/v0_max' = 0.1")

    def test_3_dynparam(self):
        self.assertIn('/localizer', run(*DYNPARAM, 'list').split())
        run(*DYNPARAM, 'set', 'localizer', 'dpso/particles', '50')
        self.drive(1)
        fixture.wait_for(lambda: self.particles() == 50, DEADLINE_S, '50 particles')
        self.assertEqual(rospy.get_param('/localizer/dpso/particles'), 50)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'dump.yaml')
            run(*DYNPARAM, 'dump', 'localizer', path)
            make_plain(path)
            before = self.values()
            self.client.update_configuration({'tracker': 'pf_linear', 'dpso/particles': 80, 'prune': False,
                                              'state/max_scale': 12.5})
            run(*DYNPARAM, 'load', 'localizer', path)
        self.assertEqual(self.values(), before)
        self.assertIn("'dpso/particles': 50", run(*DYNPARAM, 'get', 'localizer'))

    def test_4_rosparam_dump_and_restart(self):
        change = {'tracker': 'pf_gaussian', 'dpso/v0_min': 1e-6, 'pf/particles': 123, 'image_timeout': 0.1 + 0.2,
                  'prune': False}
        self.client.update_configuration(dict(change))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'dump.yaml')
            run('rosparam', 'dump', path, '/localizer')
            run('rosparam', 'load', path, '/second')
        program = roslib.packages.find_node('visual_localization', 'localizer_node')[0]
        node = subprocess.Popen([program, '__name:=second', 'global_localization:=second_global_localization'])
        try:
            second = Client('/second', timeout=60.0)
            self.assertEqual(values_of(second.get_configuration(60.0)), self.values())
            self.assertEqual(rospy.get_param('/second'), rospy.get_param('/localizer'))
            for name, value in change.items():
                self.assertEqual(second.get_configuration(60.0)[name], value)
        finally:
            node.terminate()
            node.wait()


if __name__ == '__main__':
    rospy.init_node('reconfigure_test')
    rostest.rosrun('visual_localization', 'reconfigure_test', ReconfigureTest, sys.argv)
