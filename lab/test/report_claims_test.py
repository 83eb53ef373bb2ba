#!/usr/bin/python3
"""The table of the papers' claims, on made-up results: when a claim agrees, contradicts, or is open."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[1] / 'report_claims.py'
CONFIG = SCRIPT.parents[1] / 'config/evaluation'
PAPERS = """experiment,source,train_group,test_group,method,metric,value
made,"a paper",a,a,fast,mean_err_m,1.0
made,"a paper",a,a,slow,mean_err_m,2.0
"""
CLAIMS = """claims:
  - {claim: fast errs less, experiment: made, metric: mean_err_m, less: [fast, slow]}
  - {claim: fast errs half as much, experiment: made, metric: mean_err_m, ratio: [fast, slow]}
  - {claim: fast errs a metre, experiment: made, metric: mean_err_m, value: fast}
"""


class ReportClaimsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        (self.folder / 'config/papers').mkdir(parents=True)
        (self.folder / 'config/papers.csv').write_text(PAPERS, encoding='utf-8')
        (self.folder / 'config/papers/claims.yaml').write_text(CLAIMS, encoding='utf-8')

    def write(self, preset: str, fast: list, slow: list) -> None:
        made = self.folder / 'out' / preset / 'made'
        made.mkdir(parents=True)
        rows = ['train_round,test_round,train_group,test_group,method,mean_err_m']
        for i, (a, b) in enumerate(zip(fast, slow)):
            rows += [f'a1,a{i + 2},a,a,fast,{a}', f'a1,a{i + 2},a,a,slow,{b}']
        (made / 'pairs.csv').write_text('\n'.join(rows) + '\n', encoding='utf-8')
        comparison = made.parent / 'comparison'
        comparison.mkdir()
        (comparison / 'summary.csv').write_text('train_group,test_group,method,runs,mean_err_m,std_err_m\n', encoding='utf-8')

    def run_script(self) -> subprocess.CompletedProcess:
        return subprocess.run([str(SCRIPT), str(self.folder / 'out'), '--config', str(self.folder / 'config')],
                              capture_output=True, text=True, check=False)

    def verdicts(self) -> list:
        result = self.run_script()
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        lines = (self.folder / 'out/claims.md').read_text(encoding='utf-8').splitlines()
        return [[cell.strip() for cell in line.split('|')[4:8:2] + line.split('|')[6:7]]
                for line in lines if line.startswith('| fast')]

    def test_a_claim_agrees_contradicts_or_is_open(self):
        self.write('paper', [1.0, 1.1, 0.9, 1.0], [2.0, 2.1, 2.0, 1.9])
        self.write('paper_program', [2.0, 1.0, 2.2, 1.2], [1.9, 1.5, 1.8, 1.6])
        less, ratio, value = self.verdicts()
        self.assertEqual((less[0], less[1]), ('agrees', 'open'))
        self.assertEqual((ratio[0], ratio[1]), ('agrees', '**contradicts**'))
        self.assertEqual((value[0], value[1]), ('agrees', '**contradicts**'))

    def test_the_other_sign_contradicts(self):
        self.write('paper', [2.0, 2.1, 2.0, 1.9], [1.0, 1.1, 0.9, 1.0])
        self.write('paper_program', [1.0], [2.0])
        less = self.verdicts()[0]
        self.assertEqual((less[0], less[1]), ('**contradicts**', 'open'), 'one pair has no interval')

    def test_the_claims_that_ship_name_methods_of_the_experiments_that_ship(self):
        import yaml
        claims = yaml.safe_load((CONFIG / 'papers/claims.yaml').read_text(encoding='utf-8'))
        for claim in claims['claims']:
            text = (CONFIG / f"{claim['experiment']}.yaml").read_text(encoding='utf-8')
            self.assertIn('preset: paper', text)
            named = claim.get('less') or claim.get('ratio') or [claim['value']]
            for method in named:
                word = method.split()[0].split('-')[0]
                self.assertIn(word, text, claim)
        self.assertLessEqual(set(claims['why']), {claim['claim'] for claim in claims['claims']})

    def test_what_is_missing_is_one_line(self):
        self.write('paper', [1.0, 1.0], [2.0, 2.1])
        (self.folder / 'out/paper/made/pairs.csv').write_text('method\n', encoding='utf-8')
        result = self.run_script()
        self.assertEqual(result.returncode, 1)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)


if __name__ == '__main__':
    unittest.main()
