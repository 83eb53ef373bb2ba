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
import tempfile
import unittest
import zlib
from pathlib import Path
from unittest import mock

import cv2
import numpy as np
import PIL.Image
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
        if self.output.is_file():
            self.output.unlink()
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


    def test_rows_in_the_order_of_the_images(self):
        for number in (9, 10, 11):
            self.picture(f'frame{number}.png')
        for text, said, stamps in (('x,y\n1,5\n2,6\n3,7\n', '2 s from row to row', [0, 2, 4]),
                                   ('t,x,y\n7,1,5\n8.5,2,6\n9,3,7\n', 'in the order of their names', [0, 1.5, 2])):
            result = self.start('csv', self.write('p.csv', text), '--images', self.images, '--period', 2)
            self.assertIn(said, result.stdout, result.stderr)
            topics = messages(self.output)
            np.testing.assert_allclose(self.places(topics[FIXES]), [(1, 5), (2, 6), (3, 7)], atol=2e-3)
            times = [image.header.stamp.to_sec() for image in topics[IMAGES]]
            np.testing.assert_allclose(np.array(times) - times[0], stamps, atol=1e-6)


GPX = """<?xml version="1.0"?><gpx xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>
<trkpt lat="48.5" lon="9.0"><ele>400</ele><time>2024-06-01T10:00:00Z</time></trkpt>
<trkpt lat="48.5001" lon="9.0"><time>2024-06-01T10:00:10.500Z</time></trkpt>
<trkpt lat="48.5002" lon="9.0001"><time>2024-06-01T12:00:20+02:00</time></trkpt></trkseg></trk></gpx>"""
GPX_START_S = 1717236000


class PhotosTest(ImportTest):
    """Photographs of a walk, by EXIF or by their names, beside a GPX file or with positions of their own."""

    def photo(self, name: str, taken: str, place: tuple = None, zone: str = None):
        """A JPEG with EXIF. `place`: latitude and longitude, each as degrees, minutes and seconds with its sign."""
        exif = PIL.Image.Exif()
        exif[0x8769] = {0x9003: taken, **({0x9011: zone} if zone else {})}
        if place:
            (north, latitude), (east, longitude) = place
            exif[0x8825] = {1: north, 2: latitude, 3: east, 4: longitude, 5: b'\0', 6: 401.5, 31: 4.0}
        PIL.Image.fromarray(np.full((60, 80, 3), 90, np.uint8)).save(self.images / name, exif=exif)

    def test_positions_of_exif(self):
        for number, seconds in ((2, '05'), (10, '07')):
            self.photo(f'{number}.jpg', f'2024:06:01 10:00:{seconds}',
                       (('S', (48.0, 30.0, 36.0)), ('E', (9.0, 0.0, 0.0))))
        self.photo('11.jpg', '2024:06:01 10:00:09')
        result = self.start('photos', self.images)
        self.assertIn('1 of 3 photographs have no position', result.stdout, result.stderr)
        topics = messages(self.output)
        self.assertEqual([image.header.stamp.to_sec() - GPX_START_S for image in topics[IMAGES]], [5, 7, 9])
        fix = topics[FIXES][0]
        self.assertAlmostEqual(fix.latitude, -48.51)
        self.assertEqual((fix.longitude, fix.altitude, fix.position_covariance[0]), (9.0, 401.5, 16.0))

    def test_a_track_beside_a_camera_of_another_time_zone(self):
        for seconds in (2, 9):
            self.photo(f'{seconds}.jpg', f'2024:06:01 12:00:{seconds:02d}')
        track = self.write('walk.gpx', GPX)
        result = self.start('photos', self.images, '--gpx', track)
        self.assertIn('guessed: the clock of the camera is 2 h ahead of', result.stdout, result.stderr)
        topics = messages(self.output)
        self.assertEqual([image.header.stamp.to_sec() - GPX_START_S for image in topics[IMAGES]], [2, 9])
        self.assertEqual([fix.header.stamp.to_sec() - GPX_START_S for fix in topics[FIXES]], [0, 10.5, 20])
        self.assertEqual(topics[FIXES][2].longitude, 9.0001)
        for seconds in (2, 9):
            self.photo(f'{seconds}.jpg', f'2024:06:01 12:00:{seconds:02d}', zone='+00:00')
        self.refused(('walk.gpx', 'no time in common', '--start'), 'photos', self.images, '--gpx', track)

    def test_names_that_are_times(self):
        for name in ('frame_00_00_21.000.jpg', 'frame_00_00_21.500.jpg', 'frame_00_01_01.000.jpg'):
            self.picture(name)
        track = self.write('walk.gpx', GPX)
        result = self.start('photos', self.images, '--gpx', track)
        self.assertIn('guessed: the first is of the first point of the track', result.stdout, result.stderr)
        self.assertEqual([image.header.stamp.to_sec() - GPX_START_S for image in messages(self.output)[IMAGES]],
                         [0, 0.5, 40])
        self.refused(('frame_00_01_01.000.jpg', 'both have the number 0', 'photos'), 'numbered_images', self.images,
                     '--spacing', 1)

    def test_smaller_images_a_calibration_and_a_mounting(self):
        self.picture('20240601_100001.jpg', size=(60, 80))
        self.picture('20240601_100002.png', size=(60, 80))
        calibration = self.write('camera.yaml', CALIBRATION)
        topics = self.imported('photos', self.images, '--gpx', self.write('walk.gpx', GPX), '--width', 40,
                               '--camera-info', calibration, '--mount', 'left')
        shapes = [cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_UNCHANGED).shape
                  for image in topics[IMAGES]]
        self.assertEqual(shapes, [(30, 40), (30, 40)])
        info = topics['/stereo/left/camera_info'][0]
        self.assertEqual((info.width, info.height, info.K[0], info.K[2], info.K[8]), (40, 30, 50, 19.75, 1))
        camera, antenna = topics['/tf_static'][0].transforms
        self.assertEqual((camera.header.frame_id, camera.child_frame_id, antenna.child_frame_id),
                         ('base_link', 'stereo_left', 'gps'))
        q = camera.transform.rotation
        # The optical axis, z of the image, points to the left of the robot.
        self.assertAlmostEqual(2 * (q.y * q.z - q.x * q.w), 1)

    def test_what_is_wrong_is_named(self):
        self.picture('a.jpg')
        self.refused(('a.jpg: has no time', 'frame_00_00_21.000'), 'photos', self.images)
        (self.images / 'a.jpg').rename(self.images / '20240601_100001.jpg')
        self.refused(('has no photograph with a position', '--gpx'), 'photos', self.images)
        for text, words in (('<gpx', 'is not GPX'), ('<gpx/>', 'has no point with a time'),
                            (GPX.replace('48.5001', '148.5'), 'point 2: lat is not a number from -90 to 90')):
            self.refused((f'walk.gpx: {words}',), 'photos', self.images, '--gpx', self.write('walk.gpx', text))
        for mount in (('up',), ('1', '2'), ('0', '0', '0', '7', '0', '0')):
            self.refused(('--mount',), 'photos', self.images, '--mount', *mount, code=2)
        self.refused(('a.mcap: is a bag of ROS 2', f'rosbags-convert --src {self.folder} --dst a.bag'), 'photos',
                     self.folder / 'a.mcap')


CALIBRATION = """image_width: 80
image_height: 60
camera_name: c
distortion_model: plumb_bob
camera_matrix: {rows: 3, cols: 3, data: [100, 0, 40, 0, 100, 30, 0, 0, 1]}
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [100, 0, 40, 0, 0, 100, 30, 0, 0, 0, 1, 0]}
"""


def box(kind: bytes, *content: bytes) -> bytes:
    """Of ISO 14496-12."""
    data = b''.join(content)
    return struct.pack('>I4s', len(data) + 8, kind) + data


def entry(key: bytes, kind: bytes, size: int, data: bytes) -> bytes:
    """Of GoPro's metadata format."""
    return struct.pack('>4scBH', key, kind, size, len(data) // max(1, size)) + data + bytes(-len(data) % 4)


def gopro_payload(places: list, fix: int = 3) -> bytes:
    """A second of positions, latitude and longitude in degrees."""
    rows = b''.join(struct.pack('>5i', round(1e7 * latitude), round(1e7 * longitude), 400500, 0, 0)
                    for latitude, longitude in places)
    scale = struct.pack('>5i', 10**7, 10**7, 1000, 1000, 100)
    stream = (entry(b'GPSF', b'L', 4, struct.pack('>I', fix)) + entry(b'SCAL', b'l', 4, scale)
              + entry(b'GPS5', b'l', 20, rows))
    return entry(b'DEVC', b'\0', 1, entry(b'STRM', b'\0', 1, stream))


class VideoTest(ImportTest):
    """A video as a GoPro writes it."""

    def setUp(self):
        super().setUp()
        self.video = self.folder / 'ride.mp4'
        writer = cv2.VideoWriter(str(self.video), cv2.VideoWriter_fourcc(*'mp4v'), 10, (64, 48))
        for number in range(30):
            writer.write(np.full((48, 64, 3), 8 * number, np.uint8))
        writer.release()

    def add_track(self, payloads: list, created_s: int) -> None:
        """A track of one sample a second, and when the video was made."""
        data = self.video.read_bytes()
        at = data.rindex(b'moov') - 4
        moov = bytearray(data[at + 8:at + struct.unpack_from('>I', data, at)[0]])
        struct.pack_into('>I', moov, moov.index(b'mvhd') + 8, created_s + 2082844800)
        track = b''.join(payloads)
        count = len(payloads)
        table = box(b'stbl', box(b'stsd', bytes(4), struct.pack('>I', 1), box(b'gpmd', bytes(8))),
                    box(b'stts', bytes(4), struct.pack('>III', 1, count, 1000)),
                    box(b'stsc', bytes(4), struct.pack('>IIII', 1, 1, count, 1)),
                    box(b'stsz', bytes(4), struct.pack('>II', 0, count),
                        *(struct.pack('>I', len(one)) for one in payloads)),
                    box(b'stco', bytes(4), struct.pack('>II', 1, at + 8)))
        media = box(b'mdia', box(b'mdhd', bytes(12), struct.pack('>II', 1000, 1000 * count), bytes(4)),
                    box(b'minf', table))
        self.video.write_bytes(data[:at] + box(b'mdat', track) + box(b'moov', bytes(moov), box(b'trak', media)))

    def test_a_video_with_its_own_track(self):
        self.add_track([gopro_payload([(48.5, 9.0), (48.6, -9.0)], fix=0),
                        gopro_payload([(48.5, 9.0), (48.5001, -9.0)]), gopro_payload([(48.5002, 9.0)])], GPX_START_S)
        result = self.start('video', self.video, '--width', 32)
        self.assertIn('by the time at which it says to be made', result.stdout, result.stderr)
        topics = messages(self.output)
        stamps = [image.header.stamp.to_sec() - GPX_START_S for image in topics[IMAGES]]
        np.testing.assert_allclose(stamps, [0, 0.5, 1, 1.5, 2, 2.5], atol=1e-3)
        pictures = [cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_GRAYSCALE) for image in topics[IMAGES]]
        self.assertEqual({picture.shape for picture in pictures}, {(24, 32)})
        np.testing.assert_allclose([picture.mean() for picture in pictures], [0, 40, 80, 120, 160, 200], atol=8)
        np.testing.assert_allclose([(fix.header.stamp.to_sec() - GPX_START_S, fix.latitude, fix.longitude, fix.altitude)
                                    for fix in topics[FIXES]],
                                   [(1, 48.5, 9.0, 400.5), (1.5, 48.5001, -9.0, 400.5), (2, 48.5002, 9.0, 400.5)])

    def test_a_video_beside_a_track(self):
        result = self.start('video', self.video, '--gpx', self.write('ride.gpx', GPX), '--period', 1)
        self.assertIn('guessed: at the first point of the track', result.stdout, result.stderr)
        topics = messages(self.output)
        self.assertEqual([image.header.stamp.to_sec() - GPX_START_S for image in topics[IMAGES]], [0, 1, 2])
        self.assertEqual(len(topics[FIXES]), 3)

    def test_what_is_wrong_is_named(self):
        self.refused(('ride.mp4: has no track of its own (GPMF)', '--gpx'), 'video', self.video)
        self.refused(('none.mp4: there is no such file',), 'video', self.folder / 'none.mp4')
        track = self.write('ride.gpx', GPX)
        self.refused(('text.mp4: is not a video',), 'video', self.write('text.mp4', 'no video'), '--gpx', track)
        self.add_track([entry(b'DEVC', b'\0', 1, b'GPS5l\xff\xff\xff')], GPX_START_S)
        self.refused(('ride.mp4: is a broken MP4',), 'video', self.video)
        self.assertEqual(list(Path(tempfile.gettempdir()).glob('import_recording.*')), [])


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

    def test_poses_without_times(self):
        (self.sequence / 'times.txt').unlink()
        result = self.start('kitti_odometry', self.sequence)
        self.assertIn('guessed: 10 images a second', result.stdout, result.stderr)
        stamps = [image.header.stamp.to_sec() for image in messages(self.output)[IMAGES]]
        np.testing.assert_allclose(np.array(stamps) - stamps[0], [0, 0.1, 0.2], atol=1e-6)

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
