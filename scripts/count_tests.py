#!/usr/bin/python3
"""Counts the tests of a run of ctest, and the single tests in its suites and rostests by their reports.

Exit code 1 when a suite or a rostest ran and left no report.
"""
import argparse
import json
import subprocess
import sys
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import Dict, List

GTEST_REPORT = '--gtest_output=xml:'


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


def reports_of(build: Path) -> Dict[str, List[Path]]:
    """For each test of ctest with single tests in it, the reports that it writes: one for each suite of GoogleTest, and
    for a rostest one for each <test> of its launch file."""
    listed = subprocess.run(['ctest', '--show-only=json-v1'], cwd=build, stdout=subprocess.PIPE, check=True)
    reports = {}
    for test in json.loads(listed.stdout)['tests']:
        command = test.get('command', [])
        suite = [argument[len(GTEST_REPORT):] for argument in command if argument.startswith(GTEST_REPORT)]
        if suite:
            reports[test['name']] = [Path(suite[0])]
        elif command and Path(command[0]).name == 'rostest':
            launch = next(Path(argument) for argument in command if argument.endswith('.test'))
            folder = Path(environment(test)['ROS_TEST_RESULTS_DIR']) / 'visual_localization'
            names = [node.get('test-name') for node in xml.parse(launch).iter('test')]
            reports[test['name']] = [folder / f'rosunit-{name}.xml' for name in names]
    return reports


def clear(build: Path) -> None:
    for paths in reports_of(build).values():
        for path in paths:
            path.unlink(missing_ok=True)


def count(build: Path) -> int:
    """Prints the counts; 1 when a report is missing."""
    of_ctest = cases_of(build / 'ctest.xml')
    show('ctest', of_ctest)
    ran = {case.get('name') for case in of_ctest if not is_skipped(case)}
    expected = [path for name, paths in reports_of(build).items() if name in ran for path in paths]
    if not expected:
        return 0
    found = [path for path in expected if path.is_file()]
    cases = [case for path in found for case in cases_of(path)]
    show(f'single tests, {len(found)} of {len(expected)} reports', cases)
    for case in filter(is_skipped, cases):
        print(f'skipped: {case.get("classname")}.{case.get("name")}')
    for path in sorted(set(expected) - set(found)):
        print(f'count_tests: no report {path}', file=sys.stderr)
    return 0 if len(found) == len(expected) else 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('build', type=Path, help='build folder, with the report of ctest as ctest.xml')
    parser.add_argument('--clear', action='store_true', help='before a run: remove the reports of the suites and rostests')
    args = parser.parse_args()
    if args.clear:
        clear(args.build)
        return 0
    return count(args.build)


if __name__ == '__main__':
    sys.exit(main())
