#!/usr/bin/env python3
"""A recorded drive through the running node: it finds its position and keeps it; all topics agree."""
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import Image, PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

import localizer_fixture as fixture
from visual_localization.msg import LocalizationStatus, Swarm

PLOT_STATUS = pathlib.Path(__file__).resolve().parents[2] / 'scripts' / 'plot_status.py'
NEAR_M = 1.0
METRIC_M = 0.3
MOST = 0.95


class ReplayTest(unittest.TestCase):
    def setUp(self):
        self.bag = rospy.get_param('~bag')
        self.localizer = fixture.Localizer()
        self.topics = {name: fixture.Recorder('/localizer/' + name, kind) for name, kind in {
            'pose': PoseWithCovarianceStamped, 'particles': PoseArray, 'swarm': Swarm, 'particle_cloud': PointCloud2,
            'map_path': Path, 'map_markers': MarkerArray, 'path': Path, 'camera_marker': Marker, 'matches': Image,
            'dashboard': Image}.items()}
        self.diagnostics = fixture.Recorder('/diagnostics', DiagnosticArray)
        self.localizer.wait_until_up()
        self.start_plot()

    def start_plot(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.picture = pathlib.Path(folder.name) / 'status.svg'
        self.plot = subprocess.Popen([sys.executable, str(PLOT_STATUS), '--output', str(self.picture), '--every', '5'],
                                     env=dict(os.environ))
        self.addCleanup(self.plot.wait)
        self.addCleanup(self.plot.terminate)

    def test_a_drive_is_followed(self):
        player = fixture.Player(self.bag, rate=rospy.get_param('~rate'), duration_s=rospy.get_param('~duration'))
        try:
            self.localizer.wait_for_state(LocalizationStatus.TRACKING, 120.0)
            fixture.wait_for(player.ended, 300.0, 'the end of the bag')
        finally:
            player.stop()
        self.check_errors()
        self.check_poses()
        self.check_metric_poses()
        self.check_drive()
        self.check_particles()
        self.check_map_and_pictures()
        self.check_diagnostics()
        self.check_plot()

    def check_errors(self):
        tracking = {status.header.stamp.to_nsec() for status in self.localizer.status.messages()
                    if status.state == LocalizationStatus.TRACKING}
        fixes = [fix for fix in self.localizer.fix.messages() if fix.header.stamp.to_nsec() in tracking]
        errors = fixture.errors_m(fixes, fixture.truth_of(self.bag))
        print('%d images, %d of them tracking, %.0f %% of these within %.0f m, median %.2f m' % (
            len(self.localizer.fix.messages()), len(errors), 100.0 * fixture.share_below(errors, NEAR_M), NEAR_M,
            sorted(errors)[len(errors) // 2]))
        self.assertGreater(len(errors), 20)
        self.assertGreater(fixture.share_below(errors, NEAR_M), MOST)

    def check_poses(self):
        poses = self.topics['pose'].messages()
        self.assertGreater(len(poses), 20)
        for pose in poses:
            self.assertEqual(pose.header.frame_id, 'map')
            numbers = [pose.pose.pose.position.x, pose.pose.pose.position.y, pose.pose.pose.orientation.z,
                       pose.pose.pose.orientation.w] + list(pose.pose.covariance)
            self.assertTrue(all(math.isfinite(number) for number in numbers))

    def check_metric_poses(self):
        statuses = {status.header.stamp: status for status in self.localizer.status.messages()}
        poses = [(pose, statuses[pose.header.stamp]) for pose in self.topics['pose'].messages()
                 if pose.header.stamp in statuses]
        metric = [(pose, status) for pose, status in poses if status.source == LocalizationStatus.METRIC]
        fixes = {fix.header.stamp: fix for fix in self.localizer.fix.messages()}
        errors = fixture.errors_m([fixes[pose.header.stamp] for pose, _ in metric], fixture.truth_of(self.bag))
        self.assertGreater(len(metric), 0.5 * len(poses))
        print('%d of %d poses are metric, median error %.2f m' % (
            len(metric), len(poses), sorted(errors)[len(errors) // 2]))
        self.assertLess(sorted(errors)[len(errors) // 2], METRIC_M)
        for pose, status in metric:
            covariance = np.reshape(pose.pose.covariance, (6, 6))
            self.assertTrue((np.linalg.eigvalsh(covariance) > 0.0).all())
            self.assertGreaterEqual(covariance[0, 0] + covariance[1, 1], .999 * status.map_sigma_position ** 2)
            self.assertEqual(status.source_name, 'METRIC')
            self.assertGreater(status.inliers, 5)
            self.assertEqual(status.images_since_metric, 0)

    def check_drive(self):
        poses = {pose.header.stamp: pose.pose.pose for pose in self.topics['pose'].messages()}
        path = self.topics['path'].last().poses
        self.assertGreater(len(path), 20)
        for pose in path:
            self.assertEqual(pose.pose, poses[pose.header.stamp])
        shown = [marker for marker in self.topics['camera_marker'].messages() if marker.action == Marker.ADD]
        self.assertGreater(len(shown), 20)
        for marker in shown:
            camera, position = marker.points[0], poses[marker.header.stamp].position
            self.assertTrue(np.allclose((camera.x, camera.y, camera.z), (position.x, position.y, position.z)))

    def check_particles(self):
        swarm = self.topics['swarm'].last()
        self.assertAlmostEqual(sum(particle.weight for particle in swarm.particles), 1.0, places=6)
        self.assertEqual(len(self.topics['particles'].last().poses), len(swarm.particles))
        self.assertEqual(self.topics['particle_cloud'].last().width, len(swarm.particles))

    def check_map_and_pictures(self):
        self.assertGreater(len(self.topics['map_path'].last().poses), 20)
        markers = {marker.ns: marker for marker in self.topics['map_markers'].last().markers}
        self.assertGreater(len(markers['positions'].points), 20)
        self.assertGreater(len(markers['landmarks'].points), 500)
        self.assertEqual(len(markers['landmarks'].colors), len(markers['landmarks'].points))
        for picture in ('matches', 'dashboard'):
            self.assertEqual(self.topics[picture].last().encoding, 'bgr8')

    def check_diagnostics(self):
        names = {status.name for array in self.diagnostics.messages() for status in array.status}
        for task in ('localization', 'images', 'map'):
            self.assertIn('localizer: ' + task, names)

    def check_plot(self):
        self.plot.send_signal(signal.SIGINT)
        self.assertEqual(self.plot.wait(60), 0)
        # The heading, as a comment: the last state, which is no longer TRACKING seconds after the last image.
        heading = re.search(r'<!-- .*: ([A-Z_]+) -->', self.picture.read_text(encoding='utf-8'))
        self.assertIsNotNone(heading)
        states = {status.state_name for status in self.localizer.status.messages()}
        self.assertIn('TRACKING', states)
        self.assertIn(heading.group(1), states)
        self.assertEqual([path.name for path in self.picture.parent.iterdir()], ['status.svg'])


if __name__ == '__main__':
    rospy.init_node('replay_test')
    rostest.rosrun('visual_localization', 'replay_test', ReplayTest, sys.argv)
