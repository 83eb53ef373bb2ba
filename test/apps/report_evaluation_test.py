"""report_evaluation.py on made-up evaluations: its numbers, sentences and figures, and what it refuses."""
import csv
import math
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

SCRIPT = Path(sys.argv[1])
SUMMARY = ('experiment,train_group,test_group,method,runs,mean_err_m,std_err_m,comparisons_per_image,ms_per_image,'
           'sift_share,median_err_m,within_5m,steps_to_localise,steps_to_relocalise,recall_at_p99,extract_ms,match_ms,'
           'update_ms,right_share,tracking_share,wrong_claims').split(',')
TRACES = ('train_round,test_round,method,start,step,image,err_m,v0,speed_ema,quantum_share,phi2,recovering,spread_x_m,'
          'spread_y_m,diversity_m,similarity,comparisons,features,swarm_mps,robot_mps').split(',')
PAPERS = 'experiment,source,train_group,test_group,method,metric,value'.split(',')
SAME, OTHER = ('sunny', 'sunny'), ('sunny', 'cloudy')


def write_csv(path: Path, header: list, rows: list) -> None:
    """Rows of dictionaries; what a row does not have stays empty."""
    with open(path, 'w', newline='', encoding='utf-8') as file:
        writer = csv.DictWriter(file, header, restval='')
        writer.writeheader()
        writer.writerows(rows)


class Evaluation:
    """A folder such as `evaluate` leaves behind."""

    def __init__(self, folder: Path, experiment: str):
        self.folder = folder
        self.experiment = experiment
        self.rows, self.steps, self.traces, self.settings = [], [], [], []

    def method(self, group: tuple, name: str, error: object, comparisons: object = '', **more: object) -> None:
        self.rows.append(dict({'experiment': self.experiment, 'train_group': group[0], 'test_group': group[1],
                               'method': name, 'runs': 400, 'mean_err_m': error, 'comparisons_per_image': comparisons},
                              **more))

    def fill(self, methods: list, group: tuple = OTHER) -> None:
        for index, name in enumerate(methods):
            error = 2.2 + .9 * abs(math.sin(1.7 * index + len(group[1])))
            self.method(group, name, round(error, 4), round(20 + 7.3 * index, 2), std_err_m=round(.2 + error / 9, 3),
                        ms_per_image=round(9 + 5.1 * index, 2), median_err_m=round(.7 * error, 3), within_5m=.93,
                        steps_to_localise=4.2, recall_at_p99='' if index else .71, extract_ms=5.5,
                        match_ms=2.25, update_ms=.25)
            for step in range(120):
                self.steps.append({'train_group': group[0], 'test_group': group[1], 'method': name, 'step': step,
                                   'mean_err_m': round(error + 34 * math.exp(-step / (4 + index)) +
                                                       .2 * math.sin(step / 5 + index), 3),
                                   'comparisons': 30, 'sift_share': .05})

    def trace(self, name: str, swarm: bool = True, metric: bool = True) -> None:
        """One run that loses its position for a while. `metric`: with speeds in metres per second."""
        for step in range(365):
            lost = 290 <= step < 320
            row = {'train_round': 'sunny_1', 'test_round': 'cloudy_1', 'method': name, 'start': 7, 'step': step,
                   'image': (step + 7) % 365, 'err_m': round(2 + 40 * math.exp(-step / 4) + 6 * lost, 3),
                   'recovering': int(lost and 'without' not in name) if swarm else '',
                   'diversity_m': round((8 if swarm else 17 + len(name)) + 9 * lost + math.sin(step / 7), 3),
                   'similarity': .2, 'comparisons': 22, 'features': 'sift'}
            if swarm and metric:
                row.update(swarm_mps=round(.6 + lost, 4), robot_mps='' if step % 100 == 0 else .6)
            if swarm:
                row.update(v0=round(.012 + .05 * lost, 4), speed_ema=round(.006 + .01 * lost, 4))
            self.traces.append(row)

    def write(self) -> Path:
        self.folder.mkdir(parents=True, exist_ok=True)
        text = f'experiment: {self.experiment}\ntitle: A made-up evaluation\nsource: "a paper | its Table"\n'
        (self.folder / 'experiment.yaml').write_text(text, encoding='utf-8')
        write_csv(self.folder / 'summary.csv', SUMMARY, self.rows)
        write_csv(self.folder / 'pairs.csv', ['train_round', 'test_round', 'train_group', 'test_group', 'method'],
                  [{'train_round': 'sunny_1', 'test_round': 'cloudy_1', 'train_group': row['train_group'],
                    'test_group': row['test_group'], 'method': row['method']} for row in self.rows])
        write_csv(self.folder / 'methods.csv', ['method', 'key', 'value'], self.settings)
        write_csv(self.folder / 'steps.csv',
                  ['train_group', 'test_group', 'method', 'step', 'mean_err_m', 'comparisons', 'sift_share'],
                  self.steps)
        write_csv(self.folder / 'traces.csv', TRACES, self.traces)
        return self.folder


def run(*arguments: object) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True,
                          timeout=200, check=False)


class ReportTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name) / 'evaluation'

    def evaluation(self, experiment: str) -> Evaluation:
        return Evaluation(self.folder, experiment)

    def papers(self, *rows: tuple) -> Path:
        """A file with papers' numbers of one experiment: group, method, metric, value and maybe source."""
        path = self.folder.parent / 'papers.csv'
        write_csv(path, PAPERS, [dict(zip(PAPERS, (experiment, *(source or ('Someone, Table 1',)), *group, method,
                                                   metric, value)))
                                 for experiment, group, method, metric, value, *source in rows])
        return path

    def report(self, *arguments: object, figures: tuple = ()) -> str:
        """The report; checks that every figure is there, is a picture, and is linked."""
        result = run(self.folder, *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        text = (self.folder / 'report.md').read_text(encoding='utf-8')
        linked = re.findall(r'!\[[^]]*]\(figures/([^)]*)\)', text)
        found = sorted(path.name for path in self.folder.glob('figures/*'))
        self.assertEqual(sorted(linked), found)
        for name in figures:
            self.assertIn(name + '.svg', found)
        for path in self.folder.glob('figures/*.svg'):
            self.assertTrue(xml.parse(path).getroot().tag.endswith('svg'), path)
        self.assertEqual(list(self.folder.rglob('*.partial')), [])
        return text

    def assert_refused(self, code: int, *words: str, arguments: tuple = ()) -> None:
        """One line that names these, no report."""
        result = run(self.folder, *arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        for word in ('report_evaluation: ', *words):
            self.assertIn(word, result.stderr)
        self.assertFalse((self.folder / 'report.md').exists())

    def test_particles_are_held_against_the_paper(self):
        evaluation = self.evaluation('particles')
        evaluation.method(OTHER, 'DPSO-80', 3.0, 20, std_err_m=.5)
        evaluation.method(OTHER, 'PF-l-100', 2.9, 50)
        evaluation.method(OTHER, 'PF-l-300', 2.5, 40)
        evaluation.write()
        text = self.report(figures=('error', 'comparisons'))
        self.assertIn('| DPSO-80 | 3.00 ± 0.50 | 2.54 <sup>1</sup> | 20.0 | 25.9 <sup>1</sup> |', text)
        self.assertIn('Papers: <sup>1</sup> Kronfeld et al. (journal), Table 1.', text)
        self.assertIn('a paper \\| its Table', text)

    def test_claims_and_their_probability(self):
        evaluation = self.evaluation('own')
        evaluation.method(SAME, 'a', 1.5, 20, right_share=.9, tracking_share=.8, wrong_claims=.005)
        evaluation.method(OTHER, 'a', 2.5, 20, right_share=.7, tracking_share='', wrong_claims='')
        evaluation.write()
        self.assertNotIn('Right places', self.report(), 'the experiment does not say what is right')
        with open(self.folder / 'experiment.yaml', 'a', encoding='utf-8') as file:
            file.write('rounds: {right: 4, bags: [{name: x, bag: x.bag}]}\n')
        rows = [(SAME, .2, 30, .25, .5), (OTHER, .2, 10, .29, .9), (SAME, .97, 400, .99, .995)]
        write_csv(self.folder / 'reliability.csv',
                  ['train_group', 'test_group', 'method', 'from', 'images', 'mean_probability', 'not_wrong_share'],
                  [{'train_group': group[0], 'test_group': group[1], 'method': 'a', 'from': begin, 'images': images,
                    'mean_probability': probability, 'not_wrong_share': share}
                   for group, begin, images, probability, share in rows])
        text = self.report(figures=('reliability',))
        self.assertIn('## Right places and wrong claims\n\n### sunny → sunny\n\n'
                      '| method | right [%] | TRACKING [%] | wrong of these [%] | comparisons per image |', text)
        self.assertIn('| a | 90.0 | 80.0 | 0.50 | 20.0 |', text)
        self.assertIn('| method | 0.2 to 0.97 | 0.97 to 1 |', text)
        self.assertIn('| a | 60.0 (40) | 99.5 (400) |', text)
        (self.folder / 'report.md').unlink()
        (self.folder / 'reliability.csv').write_text(
            'method,from,images,mean_probability,not_wrong_share\na,0.2,3,,1\n', encoding='utf-8')
        self.assert_refused(1, 'reliability.csv', 'line 2', 'mean_probability is empty')

    def test_what_was_written_by_hand_stays(self):
        evaluation = self.evaluation('own')
        evaluation.method(SAME, 'a', 1.5, 20)
        evaluation.write()
        self.assertNotIn('## Discussion', self.report())
        report = self.folder / 'report.md'
        said = '## Discussion\n\n`a` is good.\n\n### Why\n\n- of *this*\n'
        report.write_text(report.read_text(encoding='utf-8').replace('## Figures', f'{said}\n## Figures'),
                          encoding='utf-8')
        evaluation.rows[0]['mean_err_m'] = 2.5
        evaluation.write()
        text = self.report()
        self.assertIn(f'\n{said}\n## Figures\n', text)
        self.assertIn('| a | 2.50 |', text)
        self.assertEqual(self.report(), text)

    def test_a_report_that_cannot_be_read_is_refused(self):
        evaluation = self.evaluation('own')
        evaluation.method(SAME, 'a', 1.5, 20)
        evaluation.write()
        (self.folder / 'report.md').write_bytes(b'\xff\n')
        result = run(self.folder)
        self.assertEqual((result.returncode, result.stdout), (1, ''))
        self.assertIn('report.md: is not a text in UTF-8', result.stderr)
        self.assertEqual((self.folder / 'report.md').read_bytes(), b'\xff\n')

    def test_poses_have_tables_of_their_own(self):
        evaluation = self.evaluation('metric')
        evaluation.method(OTHER, 'landmarks', .2, 20)
        evaluation.method(OTHER, 'exhaustive', 2.5, 400)
        evaluation.write()
        figures = {'metric_share': .995, 'p95_err_m': .384, 'heading_err_deg': .17, 'recall_025m_2deg': .751,
                   'recall_05m_5deg': .998, 'recall_5m_10deg': 1, 'wrong_1m_share': .0025, 'wrong_5m_share': 0,
                   'inside_95_share': .96, 'nees': 1.42}
        relative = {'relative_err_m': .036, 'relative_heading_err_deg': .04, 'relative_nees': 4.5}
        write_csv(self.folder / 'summary.csv', [*SUMMARY, *figures, *relative],
                  [{**evaluation.rows[0], **figures, **relative}, evaluation.rows[1]])
        text = self.report()
        self.assertIn('## Poses: recall within position and heading\n\n### sunny → cloudy\n', text)
        self.assertIn('| landmarks | 99.5 | 0.20 | 0.38 | 0.17 | 75.1 | 99.8 | 100.0 | 0.25 | 0.00 | 96.0 | 1.42 |', text)
        self.assertIn('| exhaustive | – | 2.50 | – | – | – | – | – | – | – | – | – |', text)
        self.assertIn('## Poses in relation to the map\n', text)
        self.assertIn('| landmarks | 0.04 | 0.04 | 4.50 |', text)

    def test_places_have_no_tables_of_poses(self):
        evaluation = self.evaluation('comparison')
        evaluation.fill(['DPSO-80'])
        evaluation.write()
        self.assertNotIn('## Poses', self.report())

    def test_sources_that_differ_are_both_shown(self):
        evaluation = self.evaluation('kidnapped')
        evaluation.fill(['not adaptive', 'adaptive, paper recovery', 'adaptive, guided recovery', 'PF-l-100'])
        evaluation.fill([f'{name}, kidnapped' for name in ('not adaptive', 'adaptive, paper recovery', 'PF-l-100')])
        evaluation.write()
        text = self.report(figures=('kidnapped', 'error', 'comparisons'))
        self.assertIn('5.58 ± 14.2 <sup>1</sup> / 6.10 ± 2.34 <sup>2</sup>', text)
        self.assertIn('2.56 ± 0.71 <sup>1</sup> |', text)

    def test_speeds_stand_in_one_table(self):
        evaluation = self.evaluation('speed')
        for index, speed in enumerate(('0.25', '0.5', '1', '2', '3', '4')):
            evaluation.method(('sunny_1', 'cloudy_1'), f'adaptive {speed}x', 2.5 + index / 10, 25)
            evaluation.method(('sunny_1', 'cloudy_1'), f'not adaptive {speed}x', 2.5 + index, 25)
        evaluation.write()
        text = self.report(figures=('speed', 'comparisons'))
        self.assertIn('| simulated speed | adaptive | adaptive (papers) | not adaptive | not adaptive (papers) |', text)
        self.assertIn('| 3 x | 2.90 | 3.20 <sup>1</sup> | 6.50 | 5.89 <sup>1</sup> |', text)

    def test_single_runs_are_drawn(self):
        evaluation = self.evaluation('single_run')
        evaluation.fill(['without recovery', 'paper recovery', 'guided recovery', 'PF-l-100'])
        for name in ('without recovery', 'paper recovery', 'guided recovery'):
            evaluation.trace(name)
        for name in ('DPSO-80', 'PF-l-100', 'PF-l-300'):
            evaluation.trace(name, swarm=name.startswith('DPSO'))
        evaluation.write()
        self.report(figures=('run', 'diversity', 'diversity_filters'))
        drawn = (self.folder / 'figures/run.svg').read_text(encoding='utf-8')
        for words in ('cumulated error [m]', 'speed [m/s]', 'speed of the robot v_R'):
            self.assertIn(words, drawn)

    def test_a_run_without_metric_speeds_is_drawn_in_shares_of_the_range(self):
        evaluation = self.evaluation('single_run')
        evaluation.fill(['paper recovery'])
        evaluation.trace('paper recovery', metric=False)
        evaluation.write()
        self.report(figures=('run',))
        drawn = (self.folder / 'figures/run.svg').read_text(encoding='utf-8')
        self.assertIn('range per image]', drawn)
        self.assertNotIn('[m/s]', drawn)

    def test_motion_grid_has_the_shape_of_the_table(self):
        evaluation = self.evaluation('motion_grid')
        for rotation in (20, 30, 40, 50, 60):
            for acceleration in ('0.01', '0.001', '0.0001', '1e-05'):
                for speed in (1, 2, 3):
                    evaluation.method(OTHER, f'PF-l-300 rot {rotation} acc {acceleration} v {speed}',
                                      round(6 - rotation / 20 - speed / 3 + float(acceleration) * 20, 3), 70)
        evaluation.write()
        text = self.report(figures=('motion_grid',))
        self.assertIn('| σ_acc | 20°, 1 v_R | 20°, 2 v_R | 20°, 3 v_R | 30°, 1 v_R |', text)
        self.assertIn('| 1e-05 | 5.63 <sup>1</sup> | 3.43 <sup>1</sup> |', text)

    def test_comparison_has_a_table_for_each_group(self):
        evaluation = self.evaluation('comparison')
        methods = ['PF-g-100', 'PF-g-300', 'PF-l-100', 'PF-l-300', 'DPSO-80', 'best single image', 'sequence matching',
                   'topological Bayes filter']
        for group in (SAME, ('cloudy', 'cloudy'), OTHER):
            evaluation.fill(methods, group)
        evaluation.write()
        text = self.report(figures=('error', 'comparisons', 'error_over_images'))
        self.assertIn('3.28 ± 0.27 <sup>1</sup> / 3.2723 ± 0.2749 <sup>2</sup>', text)
        self.assertIn('3.1649 ± 0.8907 <sup>2</sup>', text)
        self.assertEqual(text.count('| topological Bayes filter |'), 6)
        self.assertIn('| best single image | 400 |', text)

    def hybrid_report(self, experiment: str) -> str:
        """Of four pairs of groups, in which the hybrid takes SIFT for 2 % of the images in the same light."""
        evaluation = self.evaluation(experiment)
        for group, sift in ((SAME, .03), (('cloudy', 'cloudy'), .01), (OTHER, .07), (('cloudy', 'sunny'), .05)):
            for name, milliseconds, share in (('WGII + WGOH', 4, 0), ('SIFT', 40, 1), ('hybrid', 8, sift),
                                              ('DPSO + hybrid', 9, .1)):
                evaluation.fill([name], group)
                evaluation.rows[-1].update(ms_per_image=milliseconds, sift_share=share)
        evaluation.write()
        return self.report(figures=('error', 'error_over_images', 'sift_share', 'time'))

    def test_hybrid_is_compared_by_illumination(self):
        text = self.hybrid_report('hybrid')
        self.assertIn('| hybrid | 2.00 | 2.57 <sup>2</sup> | 0.0080 | 0.43 <sup>2</sup> | 5.00 | 3.92 <sup>2</sup> |',
                      text)
        text = self.hybrid_report('hybrid_set2')
        self.assertIn('| hybrid | 2.00 | 1.72 <sup>2</sup> |', text)

    def test_numbers_of_particles_are_drawn_by_kind(self):
        evaluation = self.evaluation('hybrid_particles')
        for kind in ('hybrid', 'SIFT', 'global'):
            evaluation.fill([f'{kind} {count}' for count in (100, 300, 500)], SAME)
        evaluation.rows[0]['mean_err_m'], evaluation.rows[1]['mean_err_m'] = 2.5, 2.25
        evaluation.write()
        text = self.report(figures=('error_over_images', 'error'))
        self.assertIn('| hybrid 100 | 2.50 ± 0.54 |', text)

    def test_thresholds_are_read_from_settings_or_names(self):
        evaluation = self.evaluation('thresholds')
        for step in range(6):
            name = f'hybrid d_SIFT {5 + step} d_global {3.5 + step}'
            evaluation.method(OTHER, name, 2 + step / 4, 30, sift_share=.3 / (1 + step))
            if step % 2:
                evaluation.settings += [{'method': name, 'key': 'hybrid/sift_below', 'value': 5 + step},
                                        {'method': name, 'key': 'hybrid/global_above', 'value': 3.5 + step}]
        evaluation.write()
        text = self.report(figures=('thresholds',))
        self.assertIn('| hybrid d_SIFT 7 d_global 5.5 | 5.5 | 7 | 2.50 | 30.0 | – | 10.00 |', text)

    def test_unknown_experiment_gets_the_general_report(self):
        evaluation = self.evaluation('ablation')
        evaluation.fill(['as it is', 'one | piped, and "quoted" name', 'w/o pruning'], SAME)
        evaluation.write()
        text = self.report('--format', 'svg', figures=('error', 'comparisons', 'error_over_images'))
        self.assertIn('| one \\| piped, and "quoted" name |', text)

    def test_every_experiment_survives_strange_methods_and_empty_fields(self):
        for experiment in ('speed', 'single_run', 'kidnapped', 'particles', 'motion_grid', 'comparison', 'hybrid',
                           'hybrid_particles', 'thresholds', 'ablation'):
            with self.subTest(experiment):
                self.folder = self.folder.parent / experiment
                evaluation = self.evaluation(experiment)
                evaluation.method(OTHER, 'alone', 'nan', '', std_err_m='inf', runs='')
                evaluation.method(SAME, 'alone', '')
                evaluation.method(SAME, '', 2)
                evaluation.method(SAME, 'rot x acc y v z 3.x', 0, 0, sift_share=0)
                evaluation.method(SAME, '$x_{ 2$ 2x', 1, 1, ms_per_image=0)
                evaluation.write()
                self.report()

    def test_names_are_text_for_browsers_and_terminals(self):
        evaluation = self.evaluation('<script>alert(1)</script>')
        evaluation.fill(['<img src=x onerror=alert(1)>', 'a`<script>', '\x1b[31mred\x9b0m', 'back\u202eward'])
        evaluation.write()
        text = self.report()
        self.assertNotIn('<script', text)
        self.assertNotIn('<img', text)
        self.assertEqual([letter for letter in text if letter != '\n' and not letter.isprintable()], [])
        for path in self.folder.glob('figures/*.svg'):
            self.assertNotIn('<script', path.read_text(encoding='utf-8'))
        for name in ('summary.csv',):
            (self.folder / name).write_text('\x1b[31m\n\x1b[32m\n', encoding='utf-8')
        self.assertNotIn('\x1b', run(self.folder).stderr)

    def test_curves_may_be_zero_or_empty(self):
        evaluation = self.evaluation('kidnapped')
        evaluation.fill(['A', 'B, kidnapped'])
        for index, row in enumerate(evaluation.steps):
            row['mean_err_m'] = '' if index % 3 else 0
        evaluation.write()
        self.report(figures=('kidnapped',))

    def test_only_the_summary_is_needed(self):
        evaluation = self.evaluation('particles')
        evaluation.method(OTHER, 'DPSO-80', 2.5, 20)
        evaluation.write()
        for name in ('experiment.yaml', 'pairs.csv', 'methods.csv', 'steps.csv', 'traces.csv'):
            (self.folder / name).unlink()
        self.assertTrue(self.report(figures=('error',)).startswith('# particles\n'))

    def test_same_data_give_the_same_files(self):
        evaluation = self.evaluation('comparison')
        evaluation.fill(['DPSO-80', 'PF-l-100'], SAME)
        evaluation.write()
        self.report()
        before = {path: path.read_bytes() for path in self.folder.rglob('*') if path.is_file()}
        self.report()
        self.assertEqual(before, {path: path.read_bytes() for path in self.folder.rglob('*') if path.is_file()})

    def test_other_papers_and_other_format(self):
        evaluation = self.evaluation('own')
        evaluation.method(SAME, 'A', 2)
        evaluation.method(SAME, 'B', 4)
        evaluation.write()
        papers = self.papers(('own', SAME, 'A', 'mean_err_m', '1.0'), ('own', SAME, 'b', 'mean_err_m', '1.5'))
        text = self.report('--papers', papers, '--format', 'png')
        self.assertIn('| A | 2.00 | 1.0 <sup>1</sup> |', text)
        self.assertTrue((self.folder / 'figures/error.png').read_bytes().startswith(b'\x89PNG'))

    def test_damaged_files_are_refused(self):
        evaluation = self.evaluation('particles')
        evaluation.fill(['DPSO-80'])
        evaluation.write()
        summary = (self.folder / 'summary.csv').read_text(encoding='utf-8')
        damages = {'has no rows': summary.splitlines()[0], 'is empty': '',
                   'line 2: mean_err_m is "much", not a number': re.sub(',400,[^,]*', ',400,much', summary),
                   'has no column method': summary.replace('method', 'way', 1),
                   f'line 2: has {len(SUMMARY) + 1} fields, the header {len(SUMMARY)}': summary.rstrip() + ',1\n'}
        for what, text in damages.items():
            with self.subTest(what):
                (self.folder / 'summary.csv').write_text(text, encoding='utf-8')
                self.assert_refused(1, 'summary.csv: ', what)
        (self.folder / 'summary.csv').write_bytes(summary.encode() + b'\xff\xfe,\n')
        self.assert_refused(1, 'summary.csv: is not a CSV file in UTF-8')
        (self.folder / 'summary.csv').write_text(summary, encoding='utf-8')
        (self.folder / 'experiment.yaml').write_text('a: [', encoding='utf-8')
        self.assert_refused(1, 'experiment.yaml: is not YAML')
        (self.folder / 'experiment.yaml').write_text('- a\n', encoding='utf-8')
        self.assert_refused(1, 'experiment.yaml: is not a YAML mapping')
        (self.folder / 'experiment.yaml').unlink()
        (self.folder / 'steps.csv').write_text('train_group,test_group,method,step,mean_err_m\na,b,c,,1\n')
        self.assert_refused(1, 'steps.csv: line 2: step is empty')

    def test_missing_files_are_refused(self):
        self.assert_refused(1, 'evaluation: is not a folder')
        self.folder.mkdir()
        self.assert_refused(1, 'summary.csv: No such file or directory')
        evaluation = self.evaluation('particles')
        evaluation.fill(['DPSO-80'])
        evaluation.write()
        self.assert_refused(1, 'nowhere.csv: No such file', arguments=('--papers', 'nowhere.csv'))
        (self.folder / 'figures').write_text('in the way')
        self.assert_refused(1, 'error.svg: cannot be written')

    def test_bad_usage_is_refused(self):
        self.assert_refused(2, 'invalid choice', arguments=('--format', 'gif'))
        self.assert_refused(2, 'unrecognized arguments', arguments=('--paper-plane', '1'))
        result = run()
        self.assertEqual((result.returncode, len(result.stderr.splitlines())), (2, 1))

    def test_the_papers_are_transcribed_whole(self):
        """Nothing twice, nothing that is no number; the largest table has all its cells."""
        with open(SCRIPT.parents[1] / 'config/evaluation/papers.csv', newline='', encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(rows[0]), PAPERS)
        keys = [tuple(row[name] for name in PAPERS[:-1]) for row in rows]
        self.assertEqual(len(keys), len(set(keys)))
        for row in rows:
            self.assertGreater(float(row['value']), 0, row)
        grid = [float(row['value']) for row in rows if row['source'].endswith('(journal), Table 3')]
        self.assertEqual((len(grid), min(grid), max(grid)), (60, 2.51, 5.70))


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
