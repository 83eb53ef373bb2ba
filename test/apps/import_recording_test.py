"""import_recording.py: each form of a public recording becomes a bag; what is wrong with one is named."""
import contextlib
import csv
import io
import itertools
import math
import os
import struct
import subprocess
import sys
import unittest
import zlib
from pathlib import Path
from unittest import mock

import cv2
import numpy as np
import rosbag
from program_runner import ProgramTest, run

SUNNY, SCRIPTS = Path(sys.argv[2]), Path(sys.argv[3])
sys.path.insert(0, str(SCRIPTS))
import import_recording  # noqa: E402
from local_frame import LocalFrame, geodetic  # noqa: E402

IMAGES, FIXES, TRUTH = '/stereo/left/image_raw/compressed', '/gps/fix', '/ground_truth/fix'
DATUM = (49.0, 8.4, 200.0)
FRAME = LocalFrame({'latitude_deg': DATUM[0], 'longitude_deg': DATUM[1], 'east_m': 0, 'north_m': 0})
KITTI_P0 = 'P0: 700 0 320 0 0 701 180 0 0 0 1 0\n'


def messages(bag: Path) -> dict:
    """What a bag holds, by topic."""
    topics = {}
    with rosbag.Bag(str(bag)) as file:
        for topic, message, _ in file.read_messages():
            topics.setdefault(topic, []).append(message)
    return topics


def png_header(width: int, height: int) -> bytes:
    """The beginning of a PNG of this size, and its end."""
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
    header = struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0)
    return b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', header) + chunk(b'IDAT', zlib.compress(b'')) + chunk(b'IEND', b'')


class ImportTest(ProgramTest):
    """Makes a recording of few images in the test's folder."""

    def setUp(self):
        super().setUp()
        self.images = self.folder / 'images'
        self.images.mkdir()
        self.output = self.folder / 'made.bag'

    def write(self, name: str, text: str) -> Path:
        """A text file."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')
        return path

    def picture(self, name: str, size: tuple = (20, 30), value: int = 90) -> bytes:
        """An image file; its bytes."""
        path = self.images / name
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path), np.full(size, value, np.uint8))
        return path.read_bytes()

    def start(self, *arguments) -> subprocess.CompletedProcess:
        """The script to its end, in this process: to start Python for each case takes minutes."""
        command = list(map(str, ['import_recording.py', *arguments, '--output', self.output]))
        out, err = io.StringIO(), io.StringIO()
        with mock.patch('sys.argv', command), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = import_recording.main()
            except SystemExit as end:
                code = end.code
        return subprocess.CompletedProcess(command, code, out.getvalue(), err.getvalue())

    def imported(self, *arguments) -> dict:
        """The messages of the bag that it makes."""
        result = self.start(*arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return messages(self.output)

    def refused(self, words: tuple, *arguments, code: int = 1):
        """One line that holds these words, and no bag."""
        self.assert_refused(self.start(*arguments), code, *words)
        self.assertEqual([path.name for path in self.folder.iterdir() if 'made.bag' in path.name], [])

    def places(self, fixes: list) -> np.ndarray:
        """East and north of the default datum; exact to millimetres nearby."""
        return FRAME.position(*np.array([(fix.latitude, fix.longitude) for fix in fixes]).T)


class NumberedImagesTest(ImportTest):
    """Gardens Point's form."""

    def setUp(self):
        super().setUp()
        self.data = [self.picture(f'Image{number:03d}.{ending}', value=10 * number)
                     for number, ending in ((0, 'jpg'), (1, 'png'), (3, 'jpg'))]

    def test_numbers_are_places_and_files_stay_as_they_are(self):
        topics = self.imported('numbered_images', self.images, '--positions',
                               self.write('p.csv', '0,0\n.5,.25\n1,0\n1,1\n'), '--scale', 20, -10, '--period', '2')
        self.assertEqual(set(topics), {IMAGES, FIXES})
        self.assertEqual([bytes(image.data) for image in topics[IMAGES]], self.data)
        self.assertEqual([image.format for image in topics[IMAGES]],
                         ['mono8; jpeg compressed ', 'mono8; png compressed ', 'mono8; jpeg compressed '])
        stamps = [image.header.stamp.to_sec() for image in topics[IMAGES]]
        self.assertEqual([stamp - stamps[0] for stamp in stamps], [0, 2, 6])
        self.assertEqual([fix.header.stamp.to_sec() for fix in topics[FIXES]], stamps)
        np.testing.assert_allclose(self.places(topics[FIXES]), [(0, 0), (10, -2.5), (20, -10)], atol=2e-3)
        self.assertEqual(topics[FIXES][0].position_covariance_type, 0)

    def test_a_header_names_numbers_and_degrees(self):
        table = self.write('p.csv', 'Frame;Lat [deg];Lon [deg];sigma\n3;48.5;-9;2\n1;48.25;-8.5;\n0;48;-8;\n')
        fixes = self.imported('numbered_images', self.images, '--positions', table, '--sigma', 3)[FIXES]
        self.assertEqual([(fix.latitude, fix.longitude) for fix in fixes], [(48, -8), (48.25, -8.5), (48.5, -9)])
        self.assertEqual([fix.position_covariance[0] for fix in fixes], [9, 9, 4])

    def test_without_positions_they_lie_on_a_line(self):
        fixes = self.imported('numbered_images', self.images, '--spacing', 1.5)[FIXES]
        np.testing.assert_allclose(self.places(fixes), [(0, 0), (1.5, 0), (4.5, 0)], atol=2e-3)

    def test_what_is_wrong_is_named(self):
        start = ('numbered_images', self.images, '--positions')
        for text, words in (('0,0\n1,x\n2,0\n3,0\n', ('p.csv: line 2, column 2', "'x'", '-100000 to 100000 m')),
                            ('0,0\n1,nan\n2,0\n3,0\n', ('line 2, column 2', "'nan'")),
                            ('0,0\n1e6,0\n2,0\n3,0\n', ('line 2, column 1', '100000 m')),
                            ('0,0\n1,0\n', ('Image003.jpg', 'number 3', '0 to 1')),
                            ('0,0\n1,0,5\n', ('line 2 has 3 fields, 2 are expected',)),
                            ('lat,lon\n0,0\n91,0\n', ("line 3, column 1 ('lat')", '-90 to 90 degrees')),
                            ('id,lat,lon\n0,0,0\n0,1,0\n', ('lines 2 and 3', 'number 0')),
                            ('lat,lon,x,y\n1,1,1,1\n', ('columns of both', '--column')),
                            ('lat,latitude,lon\n1,1,1\n', ("1 ('lat') and 2 ('latitude')", '--column latitude=NAME')),
                            ('a,b\n1,1\n', ('no columns of latitude and longitude', 'columns: a, b')),
                            ('"0,0\n', ('line 1', )), ('\n# nothing\n', ('no row of values',))):
            self.refused(words, *start, self.write('p.csv', text))
        self.refused(("no column 'q' for latitude", 'columns: a, b'), *start, self.write('p.csv', 'a,b\n1,1\n'),
                     '--column', 'latitude=q')
        (self.folder / 'p.csv').write_bytes(b'0,\xff\n')
        self.refused(('p.csv: is not text in UTF-8',), *start, self.folder / 'p.csv')
        self.refused(('none.csv: there is no such file',), *start, self.folder / 'none.csv')
        self.refused(('is not a file',), *start, self.folder)

    def test_images_that_cannot_be_used_are_named(self):
        arguments = ('numbered_images', self.images, '--spacing', 1)
        self.picture('b003.png')
        self.refused(('b003.png', 'Image003.jpg', 'number 3'), *arguments)
        (self.images / 'b003.png').rename(self.images / 'none.png')
        self.refused(('none.png: has no number',), *arguments)
        (self.images / 'none.png').rename(self.images / '4.png')
        self.picture('4.png', size=(10, 30))
        self.refused(('4.png: is 30 x 10, the images before are 30 x 20',), *arguments)
        for content, words in ((b'', 'is empty'), (b'\xff\xd8 no', 'is not an image')):
            (self.images / '4.png').write_bytes(content)
            self.refused(('4.png: ' + words,), *arguments)
        self.refused(('holds no image',), 'numbered_images', self.folder / 'images' / '..', '--spacing', 1)
        self.refused(('none: cannot be read',), 'numbered_images', self.folder / 'none', '--spacing', 1)

    def test_usage(self):
        for arguments, words in ((('--spacing', '0'), ('--spacing', "'0'", '0.001 to 10000')),
                                 (('--spacing', '1', '--datum', '91', '0', '0'), ('--datum', "'91'", '-90 to 90')),
                                 (('--spacing', '1', '--column', 'where=3'), ('where=3', 'latitude')),
                                 (('--spacing', '1', '--scale', '0', '1'), ('--scale', 'near to 0')), ((), ('required',))):
            self.refused(words, 'numbered_images', self.images, *arguments, code=2)
        calibration = self.write('camera.yaml', 'image_width: 640\n')
        self.refused(('camera.yaml: is not a calibration', ), 'numbered_images', self.images, '--spacing', 1,
                     '--camera-info', calibration)

    def test_it_is_a_program(self):
        result = subprocess.run([SCRIPTS / 'import_recording.py', '--help'], capture_output=True, text=True,
                                timeout=200, check=True)
        self.assertIn('import_recording.py kitti_odometry dataset', result.stdout)

    def test_a_size_is_refused_before_anything_is_decoded(self):
        (self.images / 'Image004.png').write_bytes(png_header(60000, 60000))
        (self.images / 'Image005.png').write_bytes(png_header(6000, 3000))
        arguments = ('numbered_images', self.images, '--spacing', 1)
        with mock.patch('cv2.imdecode', side_effect=lambda data, flags: self.decoded(data, flags)):
            self.refused(('Image004.png: is too large',), *arguments)
            (self.images / 'Image004.png').unlink()
            self.refused(('Image005.png: is 6000 x 3000, at most 16777216 pixels',), *arguments)

    def decoded(self, data: np.ndarray, _: int) -> np.ndarray:
        """What stands for a decoder: small files only."""
        self.assertIn(data.tobytes(), self.data)
        return np.zeros((20, 30), np.uint8)

    def test_the_partial_file_follows_no_link(self):
        victim = self.write('victim', 'precious')
        (self.folder / f'.{self.output.name}.partial').symlink_to(victim)
        self.output.symlink_to(victim)
        self.imported('numbered_images', self.images, '--spacing', 1)
        self.assertEqual(victim.read_text(), 'precious')
        self.assertFalse(self.output.is_symlink())
        mask = os.umask(0)
        os.umask(mask)
        self.assertEqual(self.output.stat().st_mode & 0o777, 0o666 & ~mask)

    def test_a_link_out_of_the_folder_is_followed_only_when_told(self):
        private = self.folder / 'private.png'
        private.write_bytes(self.data[1])
        (self.images / 'Image004.png').symlink_to(private)
        arguments = ('numbered_images', self.images, '--spacing', 1)
        self.refused(('Image004.png: lies outside of', '--allow-outside'), *arguments)
        self.assertEqual(len(self.imported(*arguments, '--allow-outside')[IMAGES]), 4)

    def test_an_output_that_cannot_be_written_is_named(self):
        self.output = self.images / 'Image000.jpg' / 'a.bag'
        self.refused(('a.bag: cannot be written',), 'numbered_images', self.images, '--spacing', 1)


class PoseFilesTest(ImportTest):
    """Fast-SeqSLAM's form."""

    def setUp(self):
        super().setUp()
        for number in (8, 9, 10):
            self.picture(f'{number}.jpg')

    def poses(self, text: str) -> np.ndarray:
        """Where three images are, for a text with {0} and {1} for their positions."""
        for number in (8, 9, 10):
            self.write(f'images/{number}.txt', text.format(number, 2 * number))
        return self.places(self.imported('images_with_poses', self.images)[FIXES])

    def test_forms_of_poses(self):
        expected = [(number, 2 * number) for number in (8, 9, 10)]  # 10 after 9
        for text in ('{0} {1}', '{0},{1},0.3', '{0} {1} 0 0 0 0 1', '[1, 0, 0, {0}; 0, 1, 0, {1}; 0, 0, 1, 5]',
                     'time: 1300\nposition.x: {0}\nposition.y: {1}\ntheta: 2'):
            np.testing.assert_allclose(self.poses(text), expected, atol=2e-3)

    def test_numbers_that_were_chosen(self):
        for number in (8, 9, 10):
            self.write(f'images/{number}.txt', f'stamp 13\ne {number}\nn 4\n')
        fixes = self.imported('images_with_poses', self.images, '--values', 2, 3)[FIXES]
        np.testing.assert_allclose(self.places(fixes), [(8, 4), (9, 4), (10, 4)], atol=2e-3)

    def test_what_is_wrong_is_named(self):
        arguments = ('images_with_poses', self.images)
        self.refused(('8.txt: there is no such file',), *arguments)
        for number in (8, 9, 10):
            self.write(f'images/{number}.txt', '1 2')
        for text, words in (('1', ('has 1 numbers', '--values')), ('1 2 3 4', ('has 4 numbers',)),
                            ('1 1e9', ('1e9 is not a number from -100000 to 100000',)), ('', ('has 0 numbers',))):
            self.write('images/9.txt', text)
            self.refused(('9.txt', *words), *arguments)


class CsvTest(ImportTest):
    """Any folder of images with a table."""

    def test_rows_of_files(self):
        for name in ('b.jpg', 'deep/a.png'):
            self.picture(name)
        table = self.write('p.tsv', 'timestamp [ns]\timage\tx\ty\tz\n1700000000123456789\tb.jpg\t1\t2\t3\n'
                           '1700000000023456789\tdeep/a.png\t0\t0\t0\n')
        topics = self.imported('csv', table, '--images', self.images)
        self.assertEqual([fix.header.stamp.to_nsec() for fix in topics[FIXES]],
                         [1700000000023456789, 1700000000123456789])
        self.assertAlmostEqual(topics[FIXES][1].altitude - topics[FIXES][0].altitude, 3, places=3)
        np.testing.assert_allclose(self.places(topics[FIXES]), [(0, 0), (1, 2)], atol=2e-3)

    def test_rows_of_fixes_and_images_named_by_stamps(self):
        for stamp in ('1403636579.763555', '1403636580.763555'):
            self.picture(f'{stamp}.png')
        table = self.write('gps.csv', '#time,latitude,longitude,altitude\n1403636579.5,48,9,100\n1403636580,,,\n'
                           '1403636581,48.0001,9,101\n')
        topics = self.imported('csv', table, '--images', self.images)
        self.assertEqual([fix.header.stamp.to_sec() for fix in topics[FIXES]], [1403636579.5, 1403636581])
        self.assertEqual(topics[IMAGES][0].header.stamp.to_nsec(), 1403636579763555000)

    def test_columns_by_position(self):
        self.picture('a.png')
        self.picture('b.png')
        table = self.write('p.txt', 'a.png 1 5\nb.png 2 6\n')
        fixes = self.imported('csv', table, '--images', self.images, '--column', 'file=1', '--column', 'east=2',
                              '--column', 'north=3')[FIXES]
        np.testing.assert_allclose(self.places(fixes), [(1, 5), (2, 6)], atol=2e-3)

    def test_other_images_become_png_without_loss(self):
        pixels = np.random.default_rng(1).integers(0, 255, (20, 30), np.uint8)
        cv2.imwrite(str(self.images / 'a.pgm'), pixels)
        image = self.imported('csv', self.write('p.csv', 'file,x,y\na.pgm,0,0\n'), '--images', self.images)[IMAGES][0]
        self.assertEqual(image.format, 'mono8; png compressed ')
        self.assertTrue(np.array_equal(cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_UNCHANGED), pixels))

    def test_what_is_wrong_is_named(self):
        self.picture('a.png')
        self.picture('b.png')
        self.picture('../private.png')
        for text, words in (
                ('file,x,y\na.png,0,0\nc.png,1,1\n', ("line 3, column 1 ('file')", 'c.png')),
                ('file,t,x,y\na.png,5,0,0\nb.png,5,1,1\n', ('b.png', 'has the stamp of a.png')),
                ('file,t,x,y\na.png,-5,0,0\n', ("line 2, column 2 ('t')", "'-5'", '0 to 1e+20')),
                ('t,x,y\n5,0,0\n', ('a.png: is not named by a stamp', '--column file=NAME')),
                ('x,y\n5,0\n', ('neither files nor stamps', 'columns: x, y')),
                ('file,x,y\na.png,,\n', ('has no position',)),
                ('file,x,y\n../images/../private.png,0,0\n', ('private.png: lies outside of', '--allow-outside')),
                (f'file,x,y\n{self.folder}/private.png,0,0\n', ('private.png: lies outside of',)),
                ('file,x,y\na.png,0\x1b[2J,0\n', ('line 2', '?[2J'))):
            self.refused(words, 'csv', self.write('p.csv', text), '--images', self.images)


class KittiTest(ImportTest):
    """A sequence: the camera looks north at first, then turns right by 90 degrees."""

    def setUp(self):
        super().setUp()
        self.sequence = self.folder / 'sequences' / '03'
        self.images = self.sequence / 'image_0'
        for number in range(3):
            self.picture(f'{number:06d}.png')
        self.write('sequences/03/times.txt', '0.0\n0.1\n0.25\n')
        self.write('sequences/03/calib.txt', KITTI_P0 + 'P1: 700 0 320 -350 0 701 180 0 0 0 1 0\nTr: 1 2\n')
        self.poses = ['1 0 0 0 0 1 0 0 0 0 1 0', '1 0 0 0 0 1 0 0 0 0 1 5', '0 0 1 1 0 1 0 -2 -1 0 0 9']
        self.write('poses/03.txt', '\n'.join(self.poses) + '\n')

    def test_a_sequence(self):
        topics = self.imported('kitti_odometry', self.sequence)
        self.assertEqual(set(topics), {IMAGES, FIXES, '/stereo/left/camera_info', '/ground_truth/pose'})
        np.testing.assert_allclose(self.places(topics[FIXES]), [(0, 0), (0, 5), (1, 9)], atol=2e-3)
        self.assertAlmostEqual(topics[FIXES][2].altitude, 202, places=3)
        self.assertAlmostEqual(topics[FIXES][0].position_covariance[0], .05**2)
        stamps = [image.header.stamp.to_nsec() for image in topics[IMAGES]]
        self.assertEqual([stamp - stamps[0] for stamp in stamps], [0, 100000000, 250000000])
        info = topics['/stereo/left/camera_info'][0]
        self.assertEqual((info.width, info.height, info.K[0], info.K[4], info.K[2]), (30, 20, 700, 701, 320))
        yaws = []
        for message in topics['/ground_truth/pose']:
            q = message.pose.orientation
            self.assertAlmostEqual(q.x**2 + q.y**2 + q.z**2 + q.w**2, 1)
            yaws.append(math.atan2(2 * (q.x * q.y + q.z * q.w), 1 - 2 * (q.y**2 + q.z**2)))
        np.testing.assert_allclose(yaws, [math.pi / 2, math.pi / 2, 0], atol=1e-9)

    def test_the_other_camera_is_where_it_is_mounted(self):
        self.images.rename(self.sequence / 'image_1')
        fixes = self.imported('kitti_odometry', self.sequence, '--camera', 1)[FIXES]
        # Half a metre to the right: east, and south once it looks east.
        np.testing.assert_allclose(self.places(fixes), [(.5, 0), (.5, 5), (1, 8.5)], atol=2e-3)

    def test_what_is_wrong_is_named(self):
        arguments = ('kitti_odometry', self.sequence)
        good = {name: (self.folder / name).read_text() for name in ('sequences/03/times.txt', 'sequences/03/calib.txt',
                                                                     'poses/03.txt')}
        for name, text, words in (
                ('sequences/03/times.txt', '0.0\n0.1\n', ('has 2 lines', 'number 2', 'at least 3')),
                ('sequences/03/times.txt', '0.0\n0.2\n0.1\n', ('line 3', '0.1 s is not after 0.2 s')),
                ('sequences/03/times.txt', '0.0\n0.1\n1e39\n', ('line 3', '1E+39 s is not from 0 to 1e+20 s')),
                ('sequences/03/times.txt', '0.0\n\n0.1\n', ('line 2', "''")),
                ('sequences/03/calib.txt', 'P1: 1\n', ('no line P0:',)),
                ('sequences/03/calib.txt', KITTI_P0.replace('700', '-700'), ('P0 is not',)),
                ('poses/03.txt', '\n'.join(self.poses[:2]), ('has 2 lines',)),
                ('poses/03.txt', good['poses/03.txt'].replace('0 0 1 1', '0 0 3 1'), ('line 3 is not a pose',)),
                ('poses/03.txt', good['poses/03.txt'].replace('-2', 'inf'), ('line 3', '12 numbers')),
                ('poses/03.txt', good['poses/03.txt'].replace('-2', '-2e7'), ('line 3', '100000'))):
            self.write(name, text)
            self.refused((Path(name).name, *words), *arguments)
            self.write(name, good[name])
        (self.folder / 'poses' / '03.txt').unlink()
        self.refused(('03.txt: there is no such file',), *arguments)


class RoundTripTest(ImportTest):
    """Images of the sample, taken out of their bag and brought back."""

    def test_a_map_and_a_drive(self):
        with rosbag.Bag(str(SUNNY)) as bag:
            truth = [(message.latitude, message.longitude) for _, message, _ in bag.read_messages([TRUTH])][:80]
            images = [message for _, message, _ in itertools.islice(bag.read_messages([IMAGES]), 80)]
        with open(self.folder / 'p.csv', 'w', newline='', encoding='utf-8') as file:
            writer = csv.writer(file)
            writer.writerow(['file', 'stamp', 'latitude', 'longitude'])
            for number, (image, place) in enumerate(zip(images, truth)):
                (self.images / f'{number}.jpg').write_bytes(image.data)
                writer.writerow([f'{number}.jpg', f'{image.header.stamp.to_nsec()}', *map(repr, place)])
        topics = self.imported('csv', self.folder / 'p.csv', '--images', self.images, '--sigma', 0.05)
        self.assertEqual([(image.header.stamp, image.data) for image in topics[IMAGES]],
                         [(image.header.stamp, image.data) for image in images])
        self.assertEqual([(fix.latitude, fix.longitude) for fix in topics[FIXES]], truth)
        made = self.folder / 'made.map'
        built = run('map_builder', '--bag', self.output, '--output', made)
        self.assertEqual(built.returncode, 0, built.stderr)
        located = run('localize', '--map', made, '--bag', self.output, '--truth-topic', FIXES, '--seed', 1, '--output',
                      self.folder / 'track.csv')
        self.assertEqual(located.returncode, 0, located.stderr)
        with open(self.folder / 'track.csv', newline='', encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), len(images))
        frame = LocalFrame(rows[-1])
        errors = [np.linalg.norm(frame.position(np.array([float(row['latitude_deg'])]),
                                                np.array([float(row['longitude_deg'])]))
                                 - frame.position(np.array([place[0]]), np.array([place[1]])))
                  for row, place in list(zip(rows, truth))[10:]]
        self.assertLess(np.median(errors), 1.0)  # images lie 0.65 m apart


class GeodeticTest(unittest.TestCase):
    """Positions of the local plane on the ellipsoid."""

    def test_known_places(self):
        self.assertEqual(geodetic((0, 0, 0), 0, 0, 0), (0, 0, 0))
        # As far along the tangent of the equator as the Earth's radius: 45 degrees on.
        latitude, longitude, altitude = geodetic((0, 10, 0), 6378137.0, 0, 0)
        self.assertAlmostEqual(longitude, 55)
        self.assertAlmostEqual(altitude, 6378137 * (math.sqrt(2) - 1), places=3)
        self.assertEqual(latitude, 0)

    def test_it_is_the_plane_nearby(self):
        for datum in ((49, 8.4, 200), (-27.5, 153, 0), (70, -179.99, 10)):
            frame = LocalFrame({'latitude_deg': datum[0], 'longitude_deg': datum[1], 'east_m': 0, 'north_m': 0})
            latitude, longitude, altitude = geodetic(datum, 30, -40, 2)
            east, north = frame.position(np.array([latitude]), np.array([longitude]))[0]
            self.assertLess(math.hypot(east - 30, north + 40), .004)  # at 200 m a degree is 3e-5 longer
            self.assertAlmostEqual(altitude, datum[2] + 2, places=3)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
