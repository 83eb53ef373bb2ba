"""The pages of a drive and of a map in a browser; skipped without chromium-driver and selenium
(install_dependencies.sh --with-browser)."""
import csv
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from program_runner import ProgramTest, first_images, run

try:
    from selenium import webdriver
    from selenium.webdriver import ActionChains
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError:
    print('skipped: no python3-selenium')
    sys.exit(77)
DRIVER = shutil.which('chromedriver')
if DRIVER is None:
    print('skipped: no chromium-driver')
    sys.exit(77)

DRIVE = Path(sys.argv[2])
HOSTILE = '<img src=x onerror=alert(1)>\u2028&amp;\'"'
OPENING_S = 3 * int(os.environ.get('VISUAL_LOCALIZATION_TEST_SLOWNESS', '1'))


def made(program: str, *arguments) -> subprocess.CompletedProcess:
    result = run(program, *arguments)
    assert result.returncode == 0, result.stderr
    return result


class ReportPageTest(ProgramTest):
    """The first 80 images of a sample drive, in a map of every second metre of them, under a hostile name."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.made = Path(folder.name)
        cls.bag = first_images(DRIVE, 80, cls.made / f'{HOSTILE}.bag')
        cls.map = cls.made / 'first.map'
        half = first_images(DRIVE, 40, cls.made / f'{HOSTILE} half.bag')
        made('map_builder', '--bag', half, '--output', cls.map, '--plot', cls.made / 'built.html')
        made('map_info', cls.map, '--ambiguity', '--report', cls.made / 'map.html')
        cls.printed = made('localize', '--map', cls.map, '--bag', cls.bag, '--output', cls.made / 'track.csv',
                           '--truth-topic', '/ground_truth/fix', '--report', cls.made / 'drive.html').stdout
        with open(cls.made / 'track.csv', newline='', encoding='utf-8') as file:
            cls.track = list(csv.DictReader(file))
        options = webdriver.ChromeOptions()
        for argument in ('--headless=new', '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage',
                         '--window-size=1400,1200', f'--user-data-dir={folder.name}/profile'):
            options.add_argument(argument)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        cls.browser = webdriver.Chrome(service=Service(DRIVER), options=options)
        cls.addClassCleanup(cls.browser.quit)

    def open(self, name: str):
        """A page, which must say nothing on the console."""
        self.browser.get((self.made / name).as_uri())
        self.assertEqual(self.browser.get_log('browser'), [])

    def text(self, identifier: str) -> str:
        return self.browser.find_element(By.ID, identifier).text

    def pixels(self, identifier: str) -> str:
        return self.browser.execute_script('return document.getElementById(arguments[0]).toDataURL()', identifier)

    def assert_shows(self, row: int):
        moment = self.text('moment')
        self.assertIn(f'Image {row},', moment)
        self.assertIn(self.track[row]['state'], moment)
        self.assertIn(f"{self.track[row]['inliers']} inliers", moment)
        self.assertIn(f"({float(self.track[row]['east_m']):.1f}, {float(self.track[row]['north_m']):.1f})", moment)

    def test_moments_are_stepped_through_and_held(self):
        self.open('drive.html')
        self.assert_shows(0)
        self.assertEqual(len(self.browser.find_elements(By.CSS_SELECTOR, '#moment img')), 2)
        keys = ActionChains(self.browser)
        keys.send_keys(Keys.ARROW_RIGHT).key_down(Keys.SHIFT).send_keys(Keys.ARROW_RIGHT).key_up(Keys.SHIFT).perform()
        self.assert_shows(11)
        self.assertIn('(held)', self.text('moment'))
        before = self.pixels('map_marks')
        ActionChains(self.browser).send_keys(Keys.ARROW_LEFT).perform()
        self.assert_shows(10)
        self.assertNotEqual(self.pixels('map_marks'), before)

    def test_pointing_at_a_line_or_the_map_shows_the_moment(self):
        self.open('drive.html')
        line = self.browser.find_element(By.CSS_SELECTOR, '#lines .u-over')
        ActionChains(self.browser).move_to_element(line).perform()
        shown = self.browser.find_element(By.CSS_SELECTOR, '#moment h2').text
        self.assertIn('Image 39,', shown)
        canvas = self.browser.find_element(By.ID, 'map_marks')
        for x in range(-300, 300, 10):  # somewhere there is a moment
            ActionChains(self.browser).move_to_element_with_offset(canvas, x, 0).perform()
            if self.browser.find_element(By.CSS_SELECTOR, '#moment h2').text != shown:
                return
        self.fail('no moment on the map')

    def test_names_are_text(self):
        for page in ('drive.html', 'map.html', 'built.html'):
            self.open(page)
            self.assertIn('onerror=alert(1)', self.text('summary'))
            self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, 'img[src=x]'), [])

    def test_the_end_of_the_map_is_the_worst_stretch(self):
        self.open('drive.html')
        rows = self.browser.find_elements(By.CSS_SELECTOR, '#weak tr.choice')
        lost = [row for row in rows if row.text.startswith('lost') and 'the map ends at' in row.text]
        self.assertTrue(lost, [row.text for row in rows])
        lost[0].find_element(By.TAG_NAME, 'summary').click()
        filter_command, add_command = (shlex.split(line) for line in
                                       lost[0].find_element(By.TAG_NAME, 'pre').get_property('textContent').split('\n'))
        self.assertEqual(filter_command[:3], ['rosbag', 'filter', str(self.bag)])
        self.assertEqual(add_command[:6], ['rosrun', 'visual_localization', 'map_edit', 'add', '--map', str(self.map)])
        stamps = [float(row['stamp']) for row in self.track]
        kept = [stamp for stamp in stamps
                if eval(filter_command[4], {'topic': '/gps/fix', 't': Moment(stamp)})]  # pylint: disable=eval-used
        self.assertGreater(len(kept), 10)
        lost[0].click()
        self.assertIn('(held)', self.text('moment'))

    def test_a_drawn_polygon_cuts_the_map(self):
        self.open('map.html')
        self.browser.find_element(By.ID, 'cut_draw').click()
        canvas = self.browser.find_element(By.ID, 'map_marks')
        width, height = canvas.size['width'], canvas.size['height']
        for x, y in ((-.49, -.49), (0, -.49), (0, .49), (-.49, .49)):
            corner = ActionChains(self.browser)
            corner.move_to_element_with_offset(canvas, int(x * width), int(y * height)).click().perform()
        ActionChains(self.browser).send_keys(Keys.ENTER).perform()
        kept = {}
        for choice in ('inside', 'outside'):
            self.browser.find_element(By.CSS_SELECTOR, f'#cut_keep option[value={choice}]').click()
            (self.folder / 'cut.geojson').write_text(self.text('cut_file'), encoding='utf-8')
            json.loads(self.text('cut_file'))
            command = shlex.split(self.text('cut_command'))
            self.assertEqual(command[:3], ['rosrun', 'visual_localization', 'map_edit'])
            result = run('map_edit', *command[3:], cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            before, after = (int(line.split(': ')[-1].split(' images')[0]) for line in result.stdout.splitlines())
            self.assertIn(f'keeps {round(100 * after / before)} %', self.text('cut_count'))
            kept[choice] = after
        self.assertEqual(kept['inside'] + kept['outside'], before)

    def test_the_page_of_a_map_shows_what_is_in_it(self):
        self.open('built.html')
        report = made('map_info', self.map).stdout
        self.assertIn(report[report.index('headings'):].splitlines()[0], self.text('report'))
        self.assertIn('kept', self.text('facts'))
        for name in ('errors', 'fixes', 'one_way'):
            before = self.pixels('map_base')
            self.browser.find_element(By.ID, f'show_{name}').click()
            self.assertNotEqual(self.pixels('map_base'), before, name)

    def test_it_is_small_opens_soon_and_can_be_printed(self):
        self.assertLess((self.made / 'drive.html').stat().st_size, 1.5e6)
        opening_ms = []
        for _ in range(3):
            self.open('drive.html')
            opening_ms.append(self.browser.execute_script(
                'return performance.getEntriesByType("navigation")[0].loadEventEnd'))
        self.assertLess(min(opening_ms), 1000 * OPENING_S)
        self.assertGreater(len(self.browser.print_page()), 10000)


class Moment:
    """The stamp of a message as `rosbag filter` has it."""

    def __init__(self, seconds: float):
        self.seconds = seconds

    def to_sec(self) -> float:
        return self.seconds


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
