"""The layouts of other programs name topics and fields that the node has."""
import json
import re
import sys
import unittest
import xml.etree.ElementTree
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
TOPIC = '/localizer/status'


def fields_of(message: str) -> dict:
    """Type by name of the fields of a message of this package."""
    lines = (ROOT / 'msg' / f'{message}.msg').read_text(encoding='utf-8').splitlines()
    return {name: kind for kind, name in re.findall(r'^([\w/]+) (\w+)(?: *#.*)?$', '\n'.join(lines), re.M)}


def advertised() -> set:
    """The topics below the node's name."""
    source = (ROOT / 'src/node/localizer_publisher.cpp').read_text(encoding='utf-8')
    return {f'/localizer/{name}' for name in re.findall(r'advertise[^(]*\("(\w+)"', source)}


class LayoutsTest(unittest.TestCase):
    def check_field(self, path: list) -> None:
        message = 'LocalizationStatus'
        for name in path:
            fields = fields_of(message)
            self.assertIn(name, fields, path)
            message = fields[name]

    def test_foxglove_shows_fields_and_topics_that_there_are(self):
        text = (ROOT / 'config/foxglove/localizer.json').read_text(encoding='utf-8')
        layout = json.loads(text)
        shown = re.findall(rf'"{TOPIC}\.([\w.]+)"', text)
        self.assertGreater(len(shown), 10)
        for path in shown:
            self.check_field(path.split('.'))
        topics = set(re.findall(r'"(/localizer/\w+)"', text))
        self.assertIn('/localizer/drive_markers', topics)
        self.assertLessEqual(topics, advertised())
        panels = re.findall(r'"(?:first|second)": "([^"]+)"', text)
        self.assertEqual(sorted(panels), sorted(layout['configById']))

    def test_plotjuggler_shows_fields_that_there_are(self):
        root = xml.etree.ElementTree.parse(ROOT / 'config/plotjuggler/localizer.xml').getroot()
        curves = [curve.get('name') for curve in root.iter('curve')]
        self.assertGreater(len(curves), 10)
        for curve in curves:
            self.assertTrue(curve.startswith(TOPIC + '/'), curve)
            self.check_field(curve[len(TOPIC) + 1:].split('/'))

    def test_rviz_shows_topics_that_there_are(self):
        text = (ROOT / 'config/rviz/localizer.rviz').read_text(encoding='utf-8')
        topics = set(re.findall(r'Topic: (/localizer/\w+)', text))
        self.assertGreater(len(topics), 4)
        self.assertLessEqual(topics, advertised())

    def test_analyzers_are_a_group_for_each_node(self):
        analyzers = yaml.safe_load((ROOT / 'config/analyzers.yaml').read_text(encoding='utf-8'))['analyzers']
        self.assertEqual([group['contains'] for group in analyzers.values()], [['localizer: '], ['map_recorder: ']])


if __name__ == '__main__':
    unittest.main(verbosity=2)
