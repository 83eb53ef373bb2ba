"""make_round_bag.py on made-up rounds: which topics, and that truth, calibration and odometry say what they should."""
import csv
import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np
import rosbag

LAB = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(LAB))
import wheel_odometry  # noqa: E402
from make_round_bag import ALTITUDE_M  # noqa: E402
from worlds.lens import Lens, write_calibration  # noqa: E402

COUNT, RADIUS_M = 240, 30.0
DISTORTION = (-.28, .09, .001, -.002, 0)
OLD_TOPICS = {'/stereo/left/image_raw/compressed', '/gps/fix', '/ground_truth/fix'}
NEW_TOPICS = {'/stereo/left/camera_info', '/ground_truth/pose', '/odom'}


def circle() -> list:
    """A drive of 1 m/s on a circle that lies on a hillside; roll, pitch and yaw as a robot there would have."""
    rows = []
    for k in range(COUNT):
        angle = k / RADIUS_M
        east, north = RADIUS_M * math.cos(angle), RADIUS_M * math.sin(angle)
        yaw = math.atan2(math.cos(angle), -math.sin(angle))
        rows.append({'index': k, 't': k, 'x': east, 'y': north, 'z': .07 * east + .95, 'yaw': yaw,
                     'roll': .07 * math.sin(yaw), 'pitch': -.07 * math.cos(yaw)})
    return rows


class RoundBagTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.rows = circle()

    def write(self, tilted: bool, calibrated: bool = True) -> None:
        """A folder as render_world.py writes it."""
        columns = ['index', 't', 'x', 'y', 'z', 'yaw'] + (['roll', 'pitch'] if tilted else [])
        with open(self.folder / 'pose.csv', 'w', newline='', encoding='utf-8') as file:
            writer = csv.DictWriter(file, columns, extrasaction='ignore')
            writer.writeheader()
            writer.writerows(self.rows)
        for k in range(COUNT):
            cv2.imwrite(str(self.folder / f'frame_{k:04d}.png'), np.full((24, 32), k % 256, np.uint8))
        if calibrated:
            write_calibration(self.folder / 'camera.yaml', Lens((32, 24), 62, DISTORTION))

    def run_script(self, *options: str) -> subprocess.CompletedProcess:
        return subprocess.run([sys.executable, str(LAB / 'make_round_bag.py'), str(self.folder),
                               str(self.folder / 'round.bag'), *options], capture_output=True, text=True, timeout=100,
                              check=False)

    def messages(self, *options: str) -> dict:
        result = self.run_script(*options)
        self.assertEqual(result.returncode, 0, result.stderr)
        topics = {}
        with rosbag.Bag(str(self.folder / 'round.bag')) as bag:
            for topic, message, _ in bag.read_messages():
                topics.setdefault(topic, []).append(message)
        return topics

    def test_a_level_round_is_as_before(self):
        self.write(tilted=False)
        topics = self.messages()
        self.assertEqual(set(topics), OLD_TOPICS)
        self.assertEqual({fix.altitude for fix in topics['/ground_truth/fix']}, {ALTITUDE_M})

    def test_faults_do_not_change_with_what_else_is_written(self):
        self.write(tilted=False)
        plain, full = self.messages('--seed', '3'), self.messages('--seed', '3', '--full')
        self.assertEqual(set(full), OLD_TOPICS | NEW_TOPICS)
        for before, after in zip(plain['/gps/fix'], full['/gps/fix']):
            self.assertEqual(before.header.stamp, after.header.stamp)
            self.assertEqual(repr((before.latitude, before.longitude)), repr((after.latitude, after.longitude)))

    def test_every_image_has_the_exact_calibration(self):
        self.write(tilted=True)
        topics = self.messages()
        infos = topics['/stereo/left/camera_info']
        self.assertEqual(len(infos), COUNT)
        self.assertEqual(infos[0].distortion_model, 'plumb_bob')
        self.assertEqual(tuple(infos[0].D), DISTORTION)
        self.assertEqual(infos[0].K[2], 15.5)
        self.assertEqual([info.header.stamp for info in infos],
                         [image.header.stamp for image in topics['/stereo/left/image_raw/compressed']])

    def test_poses_are_exact(self):
        self.write(tilted=True)
        topics = self.messages()
        poses = topics['/ground_truth/pose']
        self.assertEqual([pose.header.stamp for pose in poses],
                         [image.header.stamp for image in topics['/stereo/left/image_raw/compressed']])
        for row, pose in zip(self.rows, poses):
            place, q = pose.pose.position, pose.pose.orientation
            self.assertEqual((place.x, place.y, place.z), (row['x'], row['y'], row['z']))
            ahead = (1 - 2 * (q.y ** 2 + q.z ** 2), 2 * (q.x * q.y + q.z * q.w), 2 * (q.x * q.z - q.y * q.w))
            turned = math.remainder(math.atan2(ahead[1], ahead[0]) - row['yaw'], 2 * math.pi)
            self.assertAlmostEqual(turned, 0, places=9)
            self.assertAlmostEqual(math.asin(ahead[2]), -row['pitch'], places=9)
            left_up = 2 * (q.y * q.z + q.x * q.w)
            self.assertAlmostEqual(left_up, math.sin(row['roll']) * math.cos(row['pitch']), places=9)

    def test_fixes_have_the_height_of_the_camera(self):
        self.write(tilted=True)
        topics = self.messages('--perfect')
        truth = [fix.altitude - ALTITUDE_M for fix in topics['/ground_truth/fix']]
        self.assertLess(np.abs(np.array(truth) - [row['z'] for row in self.rows]).max(), 1e-6)
        heights = np.array([fix.altitude for fix in topics['/gps/fix']]) - ALTITUDE_M
        self.assertAlmostEqual(heights.max() - heights.min(), .14 * RADIUS_M, delta=1.5)

    def test_odometry_drifts_within_its_covariance(self):
        self.write(tilted=True)
        odometry = self.messages()['/odom']
        self.assertAlmostEqual(len(odometry) / COUNT, wheel_odometry.RATE_HZ, delta=.3)
        self.assertEqual((odometry[0].header.frame_id, odometry[0].child_frame_id), ('odom', 'base_link'))
        last = odometry[-1]
        spread = np.sqrt(np.diag(np.array(last.pose.covariance).reshape(6, 6)))
        self.assertGreater(spread[5], math.radians(5))
        self.assertLess(spread[5], math.radians(12))
        self.assertAlmostEqual(last.twist.twist.linear.x, 1, delta=.3)
        stamps = [message.header.stamp for message in odometry]
        self.assertEqual(stamps, sorted(stamps))

    def test_added_odometry_takes_the_place_of_what_the_bag_has(self):
        self.write(tilted=True)
        before = self.messages()
        copy = self.folder / 'copy.bag'
        subprocess.run([sys.executable, str(LAB / 'add_odometry.py'), '--bag', str(self.folder / 'round.bag'),
                        '--output', str(copy), '--slip', '60', '90'], capture_output=True, timeout=100, check=True)
        with rosbag.Bag(str(copy)) as bag:
            counts = {topic: info.message_count for topic, info in bag.get_type_and_topic_info().topics.items()}
            odometry = [message for _, message, _ in bag.read_messages(['/odom'])]
        self.assertEqual(counts, {topic: len(messages) for topic, messages in before.items()})
        places = np.array([(message.pose.pose.position.x, message.pose.pose.position.y) for message in odometry])
        way = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
        self.assertAlmostEqual(way, COUNT + 3 * 30, delta=8)

    def test_refuses_a_folder_without_calibration(self):
        self.write(tilted=True, calibrated=False)
        result = self.run_script()
        self.assertEqual(result.returncode, 1)
        self.assertIn('camera.yaml does not exist', result.stderr)
        self.assertEqual(len(result.stderr.strip().splitlines()), 1)


class OdometryTest(unittest.TestCase):
    """Many drives with other errors."""

    def setUp(self):
        rows = circle()
        positions = np.array([(row['x'], row['y'], row['z']) for row in rows])
        self.steps = wheel_odometry.drive_steps(np.arange(COUNT, dtype=float), positions)
        turn = self.steps.heading[0]
        to_odom = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        angle = self.steps.stamps[-1] / RADIUS_M
        end = RADIUS_M * np.array([math.cos(angle), math.sin(angle)])
        self.truth = np.append(to_odom @ (end - positions[0, :2]), self.steps.heading[-1] - turn)

    def tracks(self, count: int) -> list:
        return [wheel_odometry.estimate(self.steps, np.random.default_rng(seed)) for seed in range(count)]

    def test_the_covariance_is_honest(self):
        errors = []
        for track in self.tracks(150):
            error = track.poses[-1] - self.truth
            errors.append(error @ np.linalg.solve(track.covariances[-1], error))
        self.assertAlmostEqual(np.mean(errors), 3, delta=.8)

    def test_errors_are_those_of_wheels(self):
        scales, drifts = [], []
        for track in self.tracks(60):
            scales.append(track.speeds.sum() / (self.steps.distance / np.diff(self.steps.stamps)).sum() - 1)
            minutes = (self.steps.stamps[-1] - self.steps.stamps[0]) / 60
            drifts.append(math.degrees(track.poses[-1, 2] - self.truth[2]) / minutes)
        self.assertAlmostEqual(np.sqrt(np.mean(np.square(scales))), .01, delta=.003)
        self.assertAlmostEqual(np.sqrt(np.mean(np.square(drifts))), 2, delta=.8)

    def test_the_same_seed_gives_the_same_track(self):
        first, second = (wheel_odometry.estimate(self.steps, np.random.default_rng(7)) for _ in range(2))
        self.assertTrue(np.array_equal(first.poses, second.poses))


if __name__ == '__main__':
    unittest.main(verbosity=2)
