#!/usr/bin/python3
"""Runs the tests on mutants and reports which no test notices. See mutate.sh."""
import argparse
import concurrent.futures
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
    os.nice(5)


def run_tests(program: str, tests: list, environment: dict, timeout_s: float) -> tuple:
    """'passed', 'failed' or 'timed out', and the processor time in seconds."""
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [program, '--gtest_filter=' + ':'.join(tests), '--gtest_fail_fast', '--gtest_brief=1'],
            env={**os.environ, 'TMPDIR': folder, **environment}, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, preexec_fn=limits)
        end = time.monotonic() + timeout_s
        ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        while ended == 0 and time.monotonic() < end:
            time.sleep(0.005)
            ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        if ended == 0:
            os.kill(process.pid, signal.SIGKILL)
            _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    seconds = usage.ru_utime + usage.ru_stime
    if ended == 0:
        return 'timed out', seconds
    return 'passed' if process.returncode == 0 else 'failed', seconds


def list_tests(program: str) -> list:
    names, suite = [], ''
    text = subprocess.run([program, '--gtest_list_tests'], capture_output=True, text=True, check=True).stdout
    for line in text.splitlines():
        if not line.startswith(' '):
            suite = line.split()[0] if line.strip() else suite
        elif suite and suite.endswith('.'):
            names.append(suite + line.split()[0])
    return names


class Suite:
    """Which tests of the programs reach which mutants, and how much processor time each takes. Those that take more
    than `slowest_s` are left out."""

    def __init__(self, programs: list, jobs: int, slowest_s: float):
        self.reached, self.seconds, self.reach = defaultdict(list), {}, {}
        tests = [(program, test) for program in programs for test in list_tests(program)]
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            for (program, test), (seconds, ids) in zip(tests, pool.map(lambda t: self.record(*t), tests)):
                self.seconds[(program, test)] = seconds
                self.reach[(program, test)] = len(ids)
                for mutant in ids if seconds <= slowest_s else ():
                    self.reached[mutant].append((program, test))

    @staticmethod
    def record(program: str, test: str):
        with tempfile.NamedTemporaryFile('r', suffix='.reached') as log:
            outcome, seconds = run_tests(program, [test], {'MUTANTS_REACHED': log.name}, 900)
            if outcome != 'passed':
                sys.exit(f'{test} of {program} fails without any mutant')
            return seconds, {int(line) for line in log.read().split()}

    def judge(self, mutant: int) -> str:
        """'killed', 'timed out', 'survived', or 'not reached'."""
        by_program = defaultdict(list)
        for program, test in self.reached.get(mutant, []):
            by_program[program].append(test)
        if not by_program:
            return 'not reached'
        for program, tests in by_program.items():
            for part in self.parts(program, tests):
                expected_s = sum(self.seconds[(program, test)] for test in part)
                outcome, _ = run_tests(program, part, {'MUTANT': str(mutant)}, 20.0 + 10.0 * expected_s)
                if outcome != 'passed':
                    return 'killed' if outcome == 'failed' else outcome
        return 'survived'

    def parts(self, program: str, tests: list):
        """Those that reach the fewest places first, since they look at them; in parts: most mutants die soon."""
        part, part_s, most_s = [], 0.0, 0.3
        for test in sorted(tests, key=lambda test: self.reach[(program, test)]):
            part.append(test)
            part_s += self.seconds[(program, test)]
            if part_s > most_s:
                yield part
                part, part_s, most_s = [], 0.0, 4.0 * most_s
        if part:
            yield part


def key_of(mutant: dict) -> tuple:
    """Which mutant it is, in a build after other changes as well."""
    return mutant['file'], mutant['what'], mutant['nth']


def outcomes_in(path: Path) -> dict:
    entries = map(json.loads, path.read_text().splitlines())
    return {key_of(entry): entry for entry in entries}


def run(options) -> int:
    """Runs the tests on each mutant and writes the outcome after each, so that a stopped run can go on."""
    mutants = json.loads(Path(options.mutants).read_text())
    results = Path(options.out)
    if not options.resume:
        results.unlink(missing_ok=True)
    done = outcomes_in(results) if results.exists() else {}
    chosen = mutants
    if 0 < options.sample < len(mutants):
        chosen = random.Random(options.seed).sample(mutants, options.sample)
    chosen = [mutant for mutant in chosen if key_of(mutant) not in done]
    print(f'{len(chosen)} mutants to run; what each test reaches is found out first', flush=True)
    suite = Suite(options.program, options.jobs, options.slowest)
    with results.open('a') as out, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for number, (mutant, outcome) in enumerate(zip(chosen, pool.map(lambda m: suite.judge(m['id']), chosen)), 1):
            out.write(json.dumps({**mutant, 'outcome': outcome}) + '\n')
            out.flush()
            if number % 50 == 0:
                print(f'{number} of {len(chosen)}', flush=True)
    return 0


def report(options) -> int:
    """A table of the files and the list of the survivors, as Markdown."""
    outcomes = outcomes_in(Path(options.results))
    by_file = defaultdict(list)
    for entry in outcomes.values():
        by_file[entry['file']].append(entry)
    print('| file | mutants | killed | survived | not reached | killed [%] |\n|---|---|---|---|---|---|')
    for path, entries in sorted(by_file.items()) + [('all', list(outcomes.values()))]:
        count = defaultdict(int)
        for entry in entries:
            count[entry['outcome']] += 1
        killed = count['killed'] + count['timed out']
        print(f'| {path} | {len(entries)} | {killed} | {count["survived"]} | {count["not reached"]} | '
              f'{100.0 * killed / len(entries):.1f} |')
    print()
    for path, entries in sorted(by_file.items()):
        for entry in sorted(entries, key=lambda e: (e['line'], e['id'])):
            if entry['outcome'] in ('survived', 'not reached'):
                print(f'- {path}:{entry["line"]} #{entry["id"]} {entry["outcome"]}: `{entry["what"]}`')
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest='command', required=True)
    command = commands.add_parser('run', help='run the tests on each')
    command.add_argument('--mutants', required=True)
    command.add_argument('--out', required=True, help='outcomes, one JSON text a line')
    command.add_argument('--resume', action='store_true', help='keep the outcomes that are there')
    command.add_argument('--jobs', type=int, default=os.cpu_count())
    command.add_argument('--sample', type=int, default=0, help='as many, chosen at random')
    command.add_argument('--slowest', type=float, default=3.0, help='tests that take more processor time are left out [s]')
    command.add_argument('--seed', type=int, default=1)
    command.add_argument('program', nargs='+', help='GoogleTest programs')
    command.set_defaults(function=run)
    command = commands.add_parser('report', help='print the table and the survivors')
    command.add_argument('results')
    command.set_defaults(function=report)
    options = parser.parse_args()
    return options.function(options)


if __name__ == '__main__':
    sys.exit(main())
