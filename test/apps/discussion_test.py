"""The discussions of experiments: numbers and words that are computed from the tables of a report."""
import re
import sys
import unittest
from pathlib import Path
from typing import Dict, List

import yaml

SCRIPTS, EXPERIMENTS, REPORTS = (Path(argument) for argument in sys.argv[1:4])
sys.path.insert(0, str(SCRIPTS))
from evaluation_report.discussion import (COMPARISONS, NO_DATA, NUMBER, PART, Cell, Tables,  # noqa: E402
                                          cells_of, computed, discussed, numbers, split_by)

REPORT = """
## Results

### sunny → sunny

| method | mean error [m] | mean error [m] (papers) | comparisons per image |
| --- | ---: | ---: | ---: |
| DPSO-80 | 1.30 ± 0.10 | 2.50 <sup>1</sup> | 20 |
| PF-l, kidnapped | 1.60 | – | 40 |

### sunny → cloudy

| method | mean error [m] | mean error [m] (papers) | comparisons per image |
| --- | ---: | ---: | ---: |
| DPSO-80 | 1.90 ± 0.10 | 2.77 | 22 |
| PF-l, kidnapped | 1.80 | 2.52 | 44 |

## Poses behind a filter

### sunny → sunny

| method | mean error [m] | NEES | to the map: mean error [m] | NEES |
| --- | ---: | ---: | ---: | ---: |
| DPSO-80 | 0.19 | 1.8 | 0.03 | 2.1 |

## Tracking and cost

### sunny → sunny

| method | images until localised | of 95 % of the runs | images until relocalised | of 95 % of the runs |
| --- | ---: | ---: | ---: | ---: |
| DPSO-80 | 1 | 2 | 3 | 4 |
"""


def shipped() -> Dict[str, str]:
    """The discussions of all experiments that have one."""
    found = {}
    for path in sorted(EXPERIMENTS.glob('*.yaml')):
        text = yaml.safe_load(path.read_text(encoding='utf-8')).get('discussion')
        if text:
            found[path.stem] = text
    return found


def section(report: str) -> str:
    """The discussion of a report."""
    return report.split('\n## Discussion\n\n')[1].split('\n## ')[0]


class DiscussionTest(unittest.TestCase):
    """On a small report."""

    def says(self, text: str, expected: str) -> None:
        """What a text becomes, without a warning."""
        warnings: List[str] = []
        self.assertEqual(discussed(text, REPORT, warnings.append), expected + '\n')
        self.assertEqual(warnings, [])

    def refuses(self, text: str, why: str) -> None:
        """A part stays as it is, with a warning."""
        warnings: List[str] = []
        self.assertEqual(discussed(text, REPORT, warnings.append), text + '\n')
        self.assertEqual(len(warnings), 1)
        self.assertIn(why, warnings[0])

    def test_one_number_is_as_in_the_table_and_several_are_a_range(self):
        self.says('{mean error | DPSO-80 | sunny → sunny} m', '1.30 m')
        self.says('{mean error | DPSO-80}', '1.30 to 1.90')
        self.says('{mean error | *}', '1.30 to 1.90')
        self.says('{mean error | *; !DPSO* | * → cloudy}', '1.80')
        self.says('{mean error (papers) | *}', '2.50 to 2.77')
        self.says('{comparisons per image | * | * → cloudy | .1f}', '22.0 to 44.0')
        self.says('{mean error\n  | DPSO-80 | sunny →\n sunny}', '1.30')

    def test_values_that_look_alike_are_one(self):
        self.says('{mean error | * | * | .0f}', '1 to 2')
        self.says('{mean error | * | * → cloudy | .0f}', '2')

    def test_ratios_differences_and_per_cent(self):
        self.says('{comparisons per image | PF-l, kidnapped / DPSO-80}', '2.0')
        self.says('{mean error | PF-l, kidnapped - DPSO-80}', '-0.10 to +0.30')
        self.says('{mean error | PF-l, kidnapped - DPSO-80 | * → cloudy | +.0f}', '0')
        self.says('{mean error | PF-l, kidnapped % DPSO-80} %', '-5 to +23 %')
        self.says('{comparisons per image | DPSO-80 / PF-l* | * | .2f}', '0.50')

    def test_columns_of_one_name_are_told_apart(self):
        self.says('{images until localised of 95 % | DPSO-80}, {images until relocalised of 95 % | DPSO-80}', '2, 4')
        self.says('{NEES | DPSO-80}, {to the map: NEES | DPSO-80}', '1.8, 2.1')
        self.says('{Poses behind a filter: mean error | DPSO-80}', '0.19')

    def test_words_follow_the_numbers(self):
        self.says('{mean error | DPSO-80 < PF-l* | sunny → sunny ? lower : not lower}', 'lower')
        self.says('{mean error | DPSO-80 < PF-l* | sunny → cloudy ? lower : not lower}', 'not lower')
        self.says('{mean error | DPSO-80 < PF-l* ? lower : not everywhere lower}', 'not everywhere lower')
        self.says('{mean error | DPSO-80 ~ PF-l* | sunny → cloudy ? as good : another}', 'as good')
        self.says('{mean error | DPSO-80 ~ PF-l* | sunny → sunny ? as good : another}', 'another')
        self.says('{comparisons per image | DPSO-80 < 22 ? few : many}', 'many')
        self.says('{comparisons per image | DPSO-80 <= 22 ? few : many}', 'few')
        self.says('{comparisons per image | DPSO-80 / PF-l* < 0.6 ? half : more}', 'half')

    def test_groups_may_be_related(self):
        self.says('{mean error | DPSO-80 | sunny → cloudy / sunny → sunny | .2f}', '1.46')
        self.says('{mean error | * | *cloudy % sunny → sunny} %', '+12 to +46 %')
        self.says('{mean error | DPSO-80 | sunny → sunny < sunny → cloudy ? harder : not harder}', 'harder')
        self.says('{mean error | DPSO-80 | sunny → sunny ~ sunny → cloudy ? alike : not alike}', 'not alike')

    def test_lines_may_be_broken_anywhere(self):
        self.says('{mean error | DPSO-80 < PF-? *; PF-l* |\nsunny → sunny\n? lower :\n not}', 'lower')

    def test_a_dash_is_no_number_of_a_later_table(self):
        report = REPORT.replace('| DPSO-80 | 1.30 ± 0.10', '| DPSO-80 | –')
        self.assertEqual(discussed('{mean error | DPSO-80 | sunny → sunny}', report, lambda _: None), NO_DATA + '\n')

    def test_exponents_are_part_of_a_number(self):
        cells = cells_of('# g\n\n| m | x |\n| --- | --- |\n| a | 1e-05 |\n')
        self.assertEqual([cell.value for cell in cells], [1e-05])

    def test_what_the_tables_do_not_have_is_said(self):
        warnings: List[str] = []
        for part in ('{mean error | PF-g-300}', '{error | DPSO-80}', '{mean error | DPSO-80 | town → town}',
                     '{mean error | DPSO-80 / PF-g-300}', '{mean error | DPSO-80 < PF-g-300 ? a : b}',
                     '{mean error (papers) | PF-l, kidnapped / DPSO-80 | sunny → sunny}',
                     '{mean error | DPSO-80 | town / sunny → sunny}',
                     '{mean error (papers) | PF-l, kidnapped | sunny → sunny}'):
            self.assertEqual(discussed(part, REPORT, warnings.append), NO_DATA + '\n')
            self.assertEqual(len(warnings), 1)
            self.assertIn('the tables have no such numbers', warnings.pop())

    def test_a_part_that_cannot_be_understood_stays_with_a_warning(self):
        self.refuses('{mean error | }', 'must be {COLUMN | METHODS | GROUPS}')
        self.refuses('{mean error | a | b | .0f | c}', 'must be {COLUMN | METHODS | GROUPS}')
        self.refuses('{mean error | DPSO-80 | * | x}', 'x')
        self.refuses('{mean error | DPSO-80 ? a : b}', 'compares nothing')
        self.refuses('{mean error | DPSO-80 < PF-l* ? a}', 'needs words for both cases')

    def test_other_braces_are_text(self):
        self.says('a set {1, 2} of {dpso/phi0}', 'a set {1, 2} of {dpso/phi0}')

    def test_paragraphs_are_filled_and_items_stay(self):
        words = 'word ' * 40 + '{mean error | DPSO-80}'
        lines = discussed(f'{words}\n{words}\n\n- {words}\n- b', REPORT, self.fail).splitlines()
        self.assertTrue(all(len(line) <= 120 for line in lines))
        self.assertEqual(lines.count(''), 1)
        self.assertTrue(lines[lines.index('') + 1].startswith('- word'))
        self.assertEqual(lines[-1], '- b')


class ShippedDiscussionTest(unittest.TestCase):
    """Of the experiments that ship, and of their reports."""

    def test_reports_say_what_their_tables_say(self):
        checked = set()
        for name, text in shipped().items():
            path = REPORTS / name / 'report.md'
            if not path.is_file():
                continue
            with self.subTest(name):
                report = path.read_text(encoding='utf-8')
                said = discussed(text, report, self.fail)
                self.assertEqual(section(report), said, f'run report_evaluation.py {path.parent} --discussion '
                                 f'{EXPERIMENTS / name}.yaml')
                self.assertNotIn(NO_DATA, said)
                self.assertNotRegex(said, r'[{}]')
                checked.add(name)
        self.assertEqual(set(shipped()) - checked, {'sample'})

    def test_readme_quotes_the_reports(self):
        readme = (REPORTS.parent.parent / 'README.md').read_text(encoding='utf-8')
        comparison, kidnapped, hybrid, park, states = (
            Tables(cells_of((REPORTS / name / 'report.md').read_text(encoding='utf-8')))
            for name in ('comparison', 'kidnapped', 'hybrid', 'park', 'states'))

        def cell(tables: Tables, column: str, method: str, group: str) -> str:
            return numbers(column, method, group, '', tables)

        for group in ('sunny → sunny', 'cloudy → cloudy', 'sunny → cloudy'):
            with self.subTest(group):
                runs, error, theirs, within, compared_with, papers, time_ms = (
                    cell(comparison, column, 'DPSO-80', group)
                    for column in ('runs', 'mean error', 'mean error (papers)', 'within 5 m', 'comparisons per image',
                                   'comparisons per image (papers)', 'time per image'))
                row = next(line for line in readme.splitlines() if line.startswith(f'| {group}, '))
                self.assertIn(f'| {runs} | {error} m | {within} % | {compared_with} of ', row)
                self.assertTrue(row.endswith(f'| {time_ms} ms | {theirs} m, {papers} |'), row)
        for title, group in (('sunny → the same day', 'sunny → sunny'), ('sunny → cloudy day', 'sunny → cloudy')):
            with self.subTest(title):
                quoted = [cell(kidnapped, 'mean error', f'{method}, kidnapped', group) + ' m, '
                          + numbers('images until relocalised', f'{method}, kidnapped', group, '.0f', kidnapped)
                          + ' images' for method in ('adaptive, paper recovery', 'adaptive, guided recovery', 'PF-l-300')]
                self.assertIn(f'| {title} | {" | ".join(quoted)} |', readme)
        ratio = numbers('comparisons per image', 'DPSO-80 / PF-l-100', '*', '.2f', comparison)
        share = numbers('SIFT steps', 'hybrid', 'Cost under changing illumination', '.0f', hybrid)
        text = ' '.join(readme.split())
        self.assertIn(f'half the comparisons of PF-l-100 (here {ratio} of them)', text)
        self.assertIn(f'SIFT for 6 % of the images across light (here {share} %)', text)
        theirs, ours = (numbers(column, 'adaptive, paper recovery, kidnapped', 'sunny → cloudy', '', kidnapped)
                        for column in ('mean error (papers)', 'mean error'))
        self.assertIn(f'{theirs} m when kidnapped across light (here {ours} m)', text)
        same, across, off_map = (numbers('TRACKING beyond 5 m', method, group, form, states) for method, group, form in
                                 (('SIFT', 'sunny → sunny', '.1f'), ('SIFT', 'sunny → cloudy', '.0f'),
                                  ('SIFT, a third of the map missing', 'sunny → sunny', '.0f')))
        self.assertIn(f'Of `TRACKING` claims {same} % are wrong by more than 5 m in the same light, {across} % across, '
                      f'and up to {off_map} % where a third is not in the map', text)
        failed = numbers('mean error', '*; !*, global', '*', '.0f', park)
        self.assertIn(f'every method with SIFT fails ({failed} m;', readme)

    def test_every_comparison_turns_round(self):
        compares = 0
        for name, text in shipped().items():
            for part in PART.findall(text):
                if ' ? ' not in ' '.join(part.split()):
                    continue
                with self.subTest(name, part=part):
                    yes, no = ' '.join(part.split()).partition(' ? ')[2].split(' : ')
                    self.assertEqual({computed(part, made_up(part, holds)) for holds in (True, False)}, {yes, no})
                    self.assertEqual(computed(part, made_up(part, True)), yes)
                    compares += 1
        self.assertGreater(compares, 30)


def made_up(part: str, holds: bool) -> Tables:
    """Tables in which a comparison holds, or does not."""
    fields = [field.strip() for field in ' '.join(part.split()).partition(' ? ')[0].split('|')]
    column, methods, groups = fields[0], fields[1], fields[2] if len(fields) > 2 else 'a → b'
    of_groups = split_by(groups, list(COMPARISONS))
    found = split_by(methods, list(COMPARISONS)) or of_groups
    assert found
    first, name, second = found
    low, high = (1.0, 2.0)
    if NUMBER.fullmatch(second):
        low, high = float(second) / 2, float(second) * 2 + 1
    above = (name in ('>', '>=')) == holds
    ours, theirs = (high, low) if above else (low, high)
    if name == '~':
        ours, theirs = (1.0, 1.0) if holds else (1.0, 2.0)
    ratio = split_by(first, ['/', '-'])
    if ratio:  # a limit for a ratio or a difference
        cells = [Cell(column, example(ratio[0]), example(groups), str(ours)),
                 Cell(column, example(ratio[2]), example(groups), '1.0' if ratio[1] == '/' else '0.0')]
    elif of_groups:
        cells = [Cell(column, example(methods), example(first), str(ours)),
                 Cell(column, example(methods), example(second), str(theirs))]
    else:
        cells = [Cell(column, example(first, second), example(groups), str(ours))]
        if not NUMBER.fullmatch(second):
            cells.append(Cell(column, example(second, first), example(groups), str(theirs)))
    return Tables(cells)


def example(patterns: str, unlike: str = '') -> str:
    """A name that fits patterns, and none of others unless both ask for the same."""
    wanted = [pattern.strip() for pattern in patterns.split(';') if not pattern.strip().startswith('!')]
    exact = [pattern for pattern in wanted if not re.search(r'[*?]', pattern)]
    pattern = exact[0] if exact else wanted[0]
    return pattern.replace('*', 'other' if unlike else 'x').replace('?', 'y')


if __name__ == '__main__':
    del sys.argv[1:]
    unittest.main()
