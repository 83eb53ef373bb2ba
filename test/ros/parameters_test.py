#!/usr/bin/env python3
"""A parameter that is not allowed stops the start, with a line that names it."""
import subprocess
import sys
import unittest

import roslib.packages
import rospy
import rostest

import localizer_fixture as fixture

TIMEOUT_S = 30.0


class ParametersTest(unittest.TestCase):
    def setUp(self):
        self.program = roslib.packages.find_node('visual_localization', 'localizer_node')[0]

    def start(self, name, parameters):
        """Output and exit code of a node with these parameters; it must end by itself."""
        rospy.set_param(name, parameters)
        self.addCleanup(rospy.delete_param, name)
        ended = subprocess.run([self.program, '__name:=' + name[1:]], stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, universal_newlines=True, timeout=TIMEOUT_S, check=False)
        return ended.returncode, ended.stdout

    def assert_refused(self, name, parameters, *expected):
        code, output = self.start(name, parameters)
        self.assertEqual(code, 1, output)
        fatal = [line for line in output.splitlines() if 'FATAL' in line]
        self.assertEqual(len(fatal), 1, output)
        for text in expected:
            self.assertIn(text, fatal[0])

    def test_unknown(self):
        self.assert_refused('/unknown', {'partikles': 80}, "'partikles'", '80', 'dpso/particles')

    def test_out_of_range(self):
        self.assert_refused('/range', {'transform_tolerance': -0.5}, "'transform_tolerance'", '-0.5', '[0, 60]')

    def test_nested(self):
        self.assert_refused('/nested', {'dpso': {'particles': 0}}, "'dpso/particles'", '0')

    def test_not_finite(self):
        self.assert_refused('/nan', {'dpso': {'inertia': float('nan')}}, "'dpso/inertia'")

    def test_wrong_type(self):
        self.assert_refused('/type', {'seed': 'many'}, "'seed'", 'many', 'integer')
        self.assert_refused('/list', {'seed': [1, 2]}, "'seed'")

    def test_choice(self):
        self.assert_refused('/choice', {'tf_mode': 'sideways'}, "'tf_mode'", 'sideways', 'map_to_odom')

    def test_transport_that_is_not_installed(self):
        self.assert_refused('/transport', {'image_transport': 'pigeon'}, "'image_transport'", 'pigeon', 'compressed, raw')

    def test_map_that_is_not_there(self):
        self.assert_refused('/no_map', {'map': '/does/not/exist.map'}, "'map'", '/does/not/exist.map')

    def test_parameters_of_others_are_left_alone(self):
        rospy.set_param('/others', {'diagnostic_period': 2.0, 'matches': {'compressed': {'format': 'jpeg'}},
                                    'dashboard': {'compressed': {'format': 'jpeg'}}})
        self.addCleanup(rospy.delete_param, '/others')
        node = subprocess.Popen([self.program, '__name:=others'])
        try:
            localizer = fixture.Localizer('/others')
            fixture.wait_for(lambda: localizer.status.last() is not None, TIMEOUT_S, 'the status of /others')
        finally:
            node.terminate()
            node.wait()


if __name__ == '__main__':
    rospy.init_node('parameters_test')
    rostest.rosrun('visual_localization', 'parameters_test', ParametersTest, sys.argv)
