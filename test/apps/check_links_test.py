"""check_links.py: which links lead nowhere."""
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(sys.argv[1])))
from check_links import anchor, broken, links  # noqa: E402

PAGE = """# A page: with `code`
See [below](#the-second), [the other](other.md#a-page-with-code) and [elsewhere](https://example.org/none.md).
```
[no link](nowhere.md)
```
## The second
![a picture](images/none.png)
<img src="images/one.png" width="720">
"""


class LinksTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.page, self.other = (Path(folder.name) / name for name in ('page.md', 'other.md'))
        for path in (self.page, self.other):
            path.write_text(PAGE, encoding='utf-8')
        (Path(folder.name) / 'images').mkdir()
        (Path(folder.name) / 'images/one.png').touch()

    def test_links_are_those_outside_of_code_and_within_the_repository(self):
        self.assertEqual(list(links(self.page)),
                         ['#the-second', 'other.md#a-page-with-code', 'images/none.png', 'images/one.png'])

    def test_files_and_headings_must_be_there(self):
        self.assertEqual([target for target in links(self.page) if broken(self.page, target)], ['images/none.png'])
        for target in ('absent.md', '#the-third', 'other.md#the-third', 'absent.md#the-second'):
            self.assertTrue(broken(self.page, target), target)

    def test_anchors_are_those_of_github(self):
        self.assertEqual(anchor('It has places, but no metric poses: source `PLACE`'),
                         'it-has-places-but-no-metric-poses-source-place')
        self.assertEqual(anchor('record_track.py and report_track.py'), 'record_trackpy-and-report_trackpy')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
