#!/usr/bin/python3
"""Counts the single tests of a run of ctest by the reports of ctest and of the rostests.

Exit code 1 when a rostest ran and left no report.
"""
import argparse
import json
import subprocess
import sys
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import Dict, List


def is_skipped(case: xml.Element) -> bool:
    return case.find('skipped') is not None or case.get('status') == 'notrun' or case.get('result') == 'skipped'


def is_failed(case: xml.Element) -> bool:
    return case.find('failure') is not None or case.find('error') is not None


def cases_of(report: Path) -> List[xml.Element]:
    return list(xml.parse(report).iter('testcase'))


def show(title: str, cases: List[xml.Element]) -> None:
    skipped, failed = sum(map(is_skipped, cases)), sum(map(is_failed, cases))
    print(f'{title}: {len(cases)} tests, {len(cases) - failed - skipped} passed, {failed} failed, {skipped} skipped')


def environment(test: dict) -> Dict[str, str]:
    """The environment that CMake gives a test."""
    values = [value for item in test.get('properties', []) if item['name'] == 'ENVIRONMENT' for value in item['value']]
    return dict(value.split('=', 1) for value in values)


def rostest_reports(build: Path) -> Dict[str, List[Path]]:
    """For each rostest that ctest knows, the reports that it writes: one for each <test> of its launch file."""
    listed = subprocess.run(['ctest', '--show-only=json-v1'], cwd=build, stdout=subprocess.PIPE, check=True)
    reports = {}
    for test in json.loads(listed.stdout)['tests']:
        command = test.get('command', [])
        if not command or Path(command[0]).name != 'rostest':
            continue
        launch = next(Path(argument) for argument in command if argument.endswith('.test'))
        folder = Path(environment(test)['ROS_TEST_RESULTS_DIR']) / 'visual_localization'
        names = [node.get('test-name') for node in xml.parse(launch).iter('test')]
        reports[test['name']] = [folder / f'rosunit-{name}.xml' for name in names]
    return reports


def clear(build: Path) -> None:
    for paths in rostest_reports(build).values():
        for path in paths:
            path.unlink(missing_ok=True)


def count(build: Path) -> int:
    """Prints the counts; 1 when a report is missing."""
    of_ctest = cases_of(build / 'ctest.xml')
    show('ctest', of_ctest)
    ran = {case.get('name') for case in of_ctest if not is_skipped(case)}
    expected = [path for name, paths in rostest_reports(build).items() if name in ran for path in paths]
    if not expected:
        return 0
    found = [path for path in expected if path.is_file()]
    cases = [case for path in found for case in cases_of(path)]
    show(f'inside the rostests, {len(found)} of {len(expected)} reports', cases)
    for path in sorted(set(expected) - set(found)):
        print(f'count_tests: no report {path}', file=sys.stderr)
    return 0 if len(found) == len(expected) else 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('build', type=Path, help='build folder, with the report of ctest as ctest.xml')
    parser.add_argument('--clear', action='store_true', help='before a run: remove the reports of the rostests')
    args = parser.parse_args()
    if args.clear:
        clear(args.build)
        return 0
    return count(args.build)


if __name__ == '__main__':
    sys.exit(main())
