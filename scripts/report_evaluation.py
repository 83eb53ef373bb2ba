#!/usr/bin/python3
"""Writes the report of an evaluation: report.md and figures/ beside the CSV files that `evaluate` wrote.

The report holds our numbers beside the papers' and shows the figures. A section "Discussion" that somebody wrote into
it by hand stays when it is written again.
"""
import argparse
import sys
from pathlib import Path
from typing import NoReturn, Optional

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from evaluation_report.data import DataError  # noqa: E402
from evaluation_report.report import write_report  # noqa: E402

# Beside the scripts in the sources, and in the share folder of an installation.
PAPERS = (HERE.parent / 'config/evaluation/papers.csv',
          HERE.parent.parent / 'share/visual_localization/config/evaluation/papers.csv')


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with the arguments."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f'report_evaluation: {message}\n')


def parse_arguments() -> argparse.Namespace:
    parser = Parser(prog='report_evaluation.py', description=(__doc__ or '').splitlines()[0])
    parser.add_argument('output', type=Path, metavar='OUTPUT_DIR', help='the folder that `evaluate` wrote')
    parser.add_argument('--papers', type=Path, metavar='FILE',
                        help='the papers\' numbers (default: config/evaluation/papers.csv of this package, if there)')
    parser.add_argument('--format', choices=['svg', 'png'], default='svg', help='of the figures (default: %(default)s)')
    return parser.parse_args()


def main() -> int:
    """Exit code 0, or 1 with one line when a file is not as it should be."""
    arguments = parse_arguments()
    papers: Optional[Path] = arguments.papers or next((path for path in PAPERS if path.is_file()), None)
    try:
        figures = write_report(arguments.output, papers, arguments.format)
    except DataError as error:
        print(f'report_evaluation: {error}', file=sys.stderr)
        return 1
    print(f'{arguments.output / "report.md"}: written, with {figures} figures')
    return 0


if __name__ == '__main__':
    sys.exit(main())
