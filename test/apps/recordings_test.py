"""Recordings as robots make them, cut from the sample: what map_builder makes of clocks, receivers and frames."""
import copy
import re
import sys
import unittest
from pathlib import Path

import cv2
import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import Quaternion, TransformStamped
from nav_msgs.msg import Odometry
from program_runner import ProgramTest, run
from tf2_msgs.msg import TFMessage

SUNNY = Path(sys.argv[2])
IMAGES = '/stereo/left/image_raw/compressed'
CAMERA_INFO = '/stereo/left/camera_info'
FIXES = '/gps/fix'
FIRST_S = 1221210000


class RecordingTest(ProgramTest):
    """Changes the sample message by message."""

    def record(self, change, name: str = 'changed.bag', calibrated: bool = False) -> Path:
        """`change`: gets topic, message and time, and returns what is recorded instead, as a list of such triples."""
        path = self.folder / name
        topics = [IMAGES, FIXES] + ([CAMERA_INFO] if calibrated else [])
        with rosbag.Bag(str(SUNNY)) as whole, rosbag.Bag(str(path), 'w') as changed:
            for topic, message, stamp in whole.read_messages(topics):
                for one in change(topic, message, stamp):
                    changed.write(*one)
        return path

    def build(self, bag: Path, *arguments):
        """The map of few images, which takes seconds."""
        return run('map_builder', '--bag', bag, '--output', self.folder / 'made.map', '--min-spacing', 3, *arguments)

    def said(self, bag: Path, *arguments) -> str:
        """What the builder says of a recording that it takes."""
        result = self.build(bag, *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def kept(self, said: str) -> int:
        return int(re.search(r'^images: (\d+) kept', said, re.M).group(1))


def later(topic, message, stamp, by_s: float) -> list:
    """The same message, stamped and recorded later."""
    by = rospy.Duration.from_sec(by_s)
    message.header.stamp += by
    return [(topic, message, stamp + by)]


class ReceiveTimesTest(RecordingTest):
    """When the messages were written, by a clock that may be anything."""

    END = rospy.Time(2 ** 32 - 1, 999999999)

    def recorded_at(self, time_of, stamped: bool = True) -> Path:
        """The first 100 s. `time_of`: gets the time of a message and returns another."""
        def change(topic, message, stamp):
            if message.header.stamp.to_sec() >= FIRST_S + 100:
                return []
            if not stamped:
                message.header.stamp = rospy.Time()
            return [(topic, message, time_of(stamp))]
        return self.record(change)

    def test_they_do_not_matter_where_messages_are_stamped(self):
        kept = self.kept(self.said(self.recorded_at(lambda stamp: stamp)))
        for always in (rospy.Time(0, 1), self.END):
            self.assertEqual(self.kept(self.said(self.recorded_at(lambda stamp, at=always: at))), kept)

    def test_an_order_that_contradicts_the_stamps_is_named(self):
        backwards = self.recorded_at(lambda stamp: rospy.Time(2 ** 32 - 1 - stamp.secs % 100000, 0))
        self.assert_refused(self.build(backwards), 1, 'stamped not after the one that was recorded before')

    def test_one_time_for_all_is_out_of_order(self):
        self.assert_refused(self.build(self.recorded_at(lambda stamp: self.END, stamped=False)), 1, 'out of order')


class ClocksTest(RecordingTest):
    """Stamps of fixes against those of images."""

    def with_fixes_later(self, by_s: float) -> Path:
        """The sample with other stamps of its fixes."""
        return self.record(lambda topic, message, stamp: later(topic, message, stamp, by_s if topic == FIXES else 0.0))

    def offset(self, by_s: float) -> float:
        """What the builder has corrected."""
        said = self.said(self.with_fixes_later(by_s))
        found = re.search(r'fixes are stamped ([\d.]+) s \(sigma ([\d.]+)\) (before|after) images of the same turn: '
                          'corrected', said)
        self.assertTrue(found, said)
        self.assertLess(float(found.group(2)), 0.6)
        return float(found.group(1)) * (1 if found.group(3) == 'after' else -1)

    def test_an_offset_is_found_and_corrected(self):
        self.assertAlmostEqual(self.offset(18.0), 18.0, delta=1.0)
        self.assertAlmostEqual(self.offset(18.0) - self.offset(-5.0), 23.0, delta=0.1)

    def test_an_offset_that_is_not_sure_is_not_called_agreement(self):
        said = self.said(self.with_fixes_later(2.0))
        agreed = re.search(r'fixes and images agree within ([\d.]+) s', said)
        self.assertFalse(agreed and float(agreed.group(1)) < 2.0, said)
        self.assertRegex(said, r'leave up to [2-9]\.\d+ s open|: corrected')

    def test_clocks_that_agree_are_left_alone(self):
        said = self.said(SUNNY)
        self.assertRegex(said, r'clocks: by the turns, fixes and images agree within 0\.\d+ s')

    def test_without_turns_it_says_that_it_did_not_check(self):
        straight = self.record(lambda topic, message, stamp: [(topic, message, stamp)]
                               if message.header.stamp.to_sec() < FIRST_S + 100 else [])
        self.assertIn('clocks: not checked', self.said(straight))

    def test_clocks_an_hour_apart_are_refused_with_both_times(self):
        result = self.build(self.with_fixes_later(3600.0))
        self.assert_refused(result, 1, 'no time in common', '1221210000.', '1221213601.', '3600.')

    def test_mirrored_images_are_named(self):
        def mirror(topic, message, stamp):
            if topic == IMAGES:
                image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_GRAYSCALE)
                message.data = cv2.imencode('.jpg', cv2.flip(image, 1))[1].tobytes()
            return [(topic, message, stamp)]
        said = self.said(self.record(mirror))
        self.assertIn('pictures turn against the path: images are mirrored', said)
        self.assertIn('check before use', said.splitlines()[-1])

    def test_both_parts_of_a_paused_recording_are_in_the_map(self):
        whole = self.kept(self.said(SUNNY))
        for pause_s in (100.0, 3600.0):
            paused = self.record(lambda topic, message, stamp, by_s=pause_s: later(
                topic, message, stamp, by_s if message.header.stamp.to_sec() > FIRST_S + 203 else 0.0))
            said = self.said(paused)
            self.assertRegex(said, rf'fixes pause for {pause_s:.0f}\.\d s after 12212102\d\d')
            self.assertGreater(self.kept(said), 0.95 * whole)

    def test_a_clock_that_goes_back_is_named(self):
        for topic_set, of in ((FIXES, 'fixes'), (IMAGES, 'images')):
            def set_back(topic, message, stamp, wanted=topic_set):
                if topic == wanted and message.header.stamp.to_sec() > FIRST_S + 203:
                    message.header.stamp -= rospy.Duration.from_sec(20.0)
                return [(topic, message, stamp)]
            said = self.said(self.record(set_back))
            self.assertRegex(said, rf'the stamps of {of} go back by (1[6-9]\.\d|20\.0) s after 12212102\d\d')
            self.assertIn('check before use', said.splitlines()[-1])


class ImagesTest(RecordingTest):
    """Images as cameras and drivers send them: the first 100 s."""

    def with_images(self, change) -> Path:
        """`change`: gets an image and its place among them, and changes it."""
        count = iter(range(10000))

        def one(topic, message, stamp):
            if stamp.to_sec() >= FIRST_S + 100:
                return []
            if topic == IMAGES:
                change(message, next(count))
            return [(topic, message, stamp)]
        return self.record(one)

    def test_a_stamp_that_cannot_be_costs_one_image(self):
        kept = self.kept(self.said(self.with_images(lambda image, place: None)))
        for strange in (0, 60):
            def change(image, place, at=strange):
                if place == at:
                    image.header.stamp += rospy.Duration(3600)
            said = self.said(self.with_images(change))
            self.assertRegex(said, r'stamps of images are not in order: 1 of \d+ images are left out')
            self.assertGreaterEqual(self.kept(said), kept - 1)
            self.assertNotIn('not in order', said.splitlines()[-1])

    def test_behind_a_clock_that_was_set_back_nothing_is_mixed(self):
        def change(image, place):
            if image.header.stamp.to_sec() > FIRST_S + 70:
                image.header.stamp -= rospy.Duration(60)
        said = self.said(self.with_images(change))
        self.assertRegex(said, r'the stamps of images go back by (59|60)\.\d s after 12212100(69|70)')
        left = int(re.search(r'(\d+) of \d+ images are left out', said).group(1))
        self.assertGreater(left, 10)
        self.assertIn('check before use', said.splitlines()[-1])

    def test_two_cameras_on_one_topic_are_refused_by_name(self):
        def change(image, place):
            image.header.frame_id = ('/left', 'left', 'right')[0 if place < 5 else place % 2 + 1]
        self.assert_refused(self.build(self.with_images(change)), 1, IMAGES, "frames 'left' and 'right'")

    def test_images_too_small_to_tell_places_apart_are_named(self):
        def change(image, place):
            small = cv2.resize(cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_GRAYSCALE), (64, 48))
            image.data = cv2.imencode('.png', small)[1].tobytes()
        said = self.said(self.with_images(change))
        self.assertRegex(said.splitlines()[-1], r'check before use.*only \d+ features an image, at 64x48 px')

    def test_a_crawler_does_not_stand(self):
        def slower(topic, message, stamp):
            if stamp.to_sec() >= FIRST_S + 60:
                return []
            message.header.stamp = rospy.Time(FIRST_S) + 40 * (message.header.stamp - rospy.Time(FIRST_S))
            return [(topic, message, message.header.stamp)]
        self.assertNotIn('while the robot stood', self.said(self.record(slower)))


def copy_of(message, **changes):
    other = copy.deepcopy(message)
    for name, value in changes.items():
        setattr(other, name, value)
    return other


class ReceiversTest(RecordingTest):
    """Fixes as drivers send them."""

    def with_fixes(self, change) -> Path:
        """`change`: gets a fix and returns those that are recorded instead."""
        return self.record(lambda topic, message, stamp: [(topic, one, stamp) for one in change(message)]
                           if topic == FIXES else [(topic, message, stamp)])

    def check_same(self, bag: Path, words: str, *arguments) -> str:
        """As many fixes believed as in the sample, and a line that says what was done."""
        said = self.said(bag, *arguments)
        self.assertIn(words, said)
        count = re.compile(r'fixes: (\d+) kept')
        expected = int(count.search(self.said(SUNNY)).group(1))
        self.assertAlmostEqual(int(count.search(said).group(1)), expected, delta=0.03 * expected)
        return said

    def test_units_of_drivers_are_understood(self):
        for words, change in (
                ('1e-7 degrees', lambda fix: [copy_of(fix, latitude=1e7 * fix.latitude, longitude=1e7 * fix.longitude)]),
                ('radians', lambda fix: [copy_of(fix, latitude=np.radians(fix.latitude),
                                                 longitude=np.radians(fix.longitude))]),
                ('0 to 360', lambda fix: [copy_of(fix, longitude=fix.longitude + 200.0)])):
            self.check_same(self.with_fixes(change), words)

    def test_latitude_and_longitude_exchanged_are_put_right(self):
        bag = self.with_fixes(lambda fix: [copy_of(fix, latitude=fix.longitude, longitude=fix.latitude)])
        self.check_same(bag, 'latitude and longitude are exchanged, by the turns: put right')

    def test_one_of_two_receivers_counts(self):
        count = iter(range(10000))

        def two(fix):
            rear = copy_of(fix, latitude=fix.latitude + 2e-5, header=copy.deepcopy(fix.header))
            fix.header.frame_id, rear.header.frame_id = 'front', 'rear'
            rear.header.stamp += rospy.Duration.from_sec(0.05)
            return [fix, rear] if next(count) % 10 else [fix]
        bag = self.with_fixes(two)
        self.check_same(bag, "those of 'front' count")
        config = self.folder / 'rear.yaml'
        config.write_text('robot: {fix_frame: rear}\n')
        self.assertIn("those of 'rear' count", self.said(bag, '--config', config))
        config.write_text('robot: {fix_frame: roof}\n')
        self.assert_refused(self.build(bag, '--config', config), 1, "robot/fix_frame 'roof'", "'front'", "'rear'")

    def test_odometry_is_a_source_of_positions(self):
        def odometry(x_m, y_m):
            count = iter(range(10000))

            def change(fix):
                message = Odometry()
                message.header.stamp, message.header.frame_id, message.child_frame_id = fix.header.stamp, 'map', 'gps'
                message.pose.pose.orientation.w = 1.0
                message.pose.pose.position.x = x_m + 73700.0 * (fix.longitude - 9.0713)
                message.pose.pose.position.y = y_m + 111200.0 * (fix.latitude - 48.5345)
                if next(count) == 50:
                    message.pose.pose.position.x, message.pose.pose.position.y = 505267.0, 9.65e6  # beyond the pole
                return [message]
            return change
        for offset_m, words in (((0.0, 0.0), 'laid about latitude 0.1'),
                                ((505267.0, 5375670.0), 'taken for UTM of zone 31 north'),
                                ((505267.0, 9.9e6), 'taken for UTM of zone 31 south')):
            self.check_same(self.with_fixes(odometry(*offset_m)), words)

    def test_a_variance_of_9999_is_none(self):
        def change(fix):
            return [copy_of(fix, position_covariance=[9999.0, 0, 0, 0, 9999.0, 0, 0, 0, 9999.0],
                            position_covariance_type=1)]
        expected = r'expected error of its positions .*'
        unknown = self.said(self.with_fixes(lambda fix: [copy_of(fix, position_covariance_type=0)]))
        said = self.said(self.with_fixes(change))
        self.assertEqual(re.search(expected, said).group(0), re.search(expected, unknown).group(0))

    def test_another_type_is_named(self):
        result = self.build(SUNNY, '--fix-topic', CAMERA_INFO)
        self.assert_refused(result, 1, f"topic '{CAMERA_INFO}' has sensor_msgs/CameraInfo", FIXES)


class FramesTest(RecordingTest):
    """Where the robot carries camera and antenna."""

    def with_frames(self, image: str, fix: str, *links) -> Path:
        """`links`: parent, child, translation."""
        def name(topic, message, stamp):
            message.header.frame_id = fix if topic == FIXES else image
            messages = [(topic, message, stamp)]
            if not self.framed:
                self.framed = True
                frames = TFMessage()
                for parent, child, (x, y, z) in links:
                    link = TransformStamped(child_frame_id=child)
                    link.header.frame_id = parent
                    link.transform.translation.x, link.transform.translation.y, link.transform.translation.z = x, y, z
                    link.transform.rotation.w = 1.0
                    frames.transforms.append(link)
                messages.insert(0, ('/tf_static', frames, stamp))
            return messages
        self.framed = False
        return self.record(name, calibrated=True)

    def test_a_body_frame_below_a_footprint_is_used(self):
        bag = self.with_frames('mast', 'gps', ('base_footprint', 'mast', (0.3, 0.0, 1.0)),
                               ('base_footprint', 'gps', (-0.2, 0.0, 0.5)))
        said = self.said(bag)
        self.assertRegex(said, r"camera by frames 'base_footprint' to 'mast', taken for one of a body .*antenna 'gps'")
        self.assertRegex(said, r'camera at 0\.30 0\.00 1\.00 m, looking -?0\.0 degrees to the left and -?0\.0 up; '
                         r'antenna at -0\.20 0\.00 0\.50 m')

    def test_a_camera_that_is_said_to_be_upside_down_is_no_mirrored_one(self):
        def turned(topic, message, stamp):
            if topic == IMAGES:
                image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_GRAYSCALE)
                message.data = cv2.imencode('.jpg', cv2.rotate(image, cv2.ROTATE_180))[1].tobytes()
            messages = [(topic, message, stamp)]
            if not self.framed:
                self.framed = True
                camera, antenna = TransformStamped(child_frame_id='stereo_left'), TransformStamped(child_frame_id='gps')
                # x of the image to the left of the robot, y up, z ahead.
                camera.transform.rotation = Quaternion(0.5, 0.5, 0.5, 0.5)
                antenna.transform.rotation.w = 1.0
                camera.header.frame_id = antenna.header.frame_id = 'base_link'
                messages.insert(0, ('/tf_static', TFMessage([camera, antenna]), stamp))
            return messages
        self.framed = False
        said = self.said(self.record(turned))
        self.assertIn("camera by frames 'base_link' to 'stereo_left'", said)
        self.assertRegex(said, 'clocks: by the turns, fixes and images agree')

    def test_unknown_frames_are_refused_by_name(self):
        links = ('base_link', 'mast', (0.3, 0.0, 1.0)), ('base_link', 'gps', (0.0, 0.0, 0.5))
        self.assert_refused(self.build(self.with_frames('usb_cam', 'gps', *links)), 1, "'base_link'", "'usb_cam'",
                            'base_link, gps, mast')
        self.assert_refused(self.build(self.with_frames('', 'gps', *links)), 1, "'' (empty)", 'base_link, gps, mast')
        self.assert_refused(self.build(self.with_frames('mast', 'antenna', *links)), 1, "'antenna'", 'robot/antenna')

    def test_a_mounting_that_the_drive_contradicts_is_named(self):
        calibrated = self.record(lambda topic, message, stamp: [(topic, message, stamp)], calibrated=True)
        config = self.folder / 'aside.yaml'
        config.write_text('robot: {camera: "0.3 0 1 0.4 0 0", antenna: "0 0 1"}\n')
        self.assertRegex(self.said(calibrated, '--config', config),
                         r'check before use .*turned against its mounting: .* 2[1-5]\.\d degrees to the right')
        config.write_text('robot: {camera: "0.3 0 1 0 0 0", antenna: "0 0 1"}\n')
        self.assertNotIn('against its mounting', self.said(calibrated, '--config', config))

    def test_half_a_mounting_is_refused(self):
        config = self.folder / 'half.yaml'
        for given, missing in (('camera: "0.3 0 1 0 0 0"', 'robot/antenna'), ('antenna: "0 0 1"', 'robot/camera')):
            config.write_text(f'robot: {{{given}}}\n')
            self.assert_refused(self.build(SUNNY, '--config', config), 1, 'is given without ' + missing)

    def test_a_mounting_in_degrees_is_refused(self):
        config = self.folder / 'degrees.yaml'
        config.write_text('robot: {camera: "0.3 0 1 90 0 0", antenna: "0 0 1"}\n')
        self.assert_refused(self.build(SUNNY, '--config', config), 1, 'robot/camera', 'no degrees')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
