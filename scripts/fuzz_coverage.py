#!/usr/bin/env python3
"""Which lines of the code that reads foreign bytes the fuzz targets reached, and which none of them did.

Builds the targets without libFuzzer and with counts (build/fuzz-coverage, clang), runs them over the corpora that
scripts/fuzz.sh made and over those that ship, and prints a table in Markdown.
"""
import argparse
import collections
import os
import subprocess
import sys
import tempfile

REPO = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BUILD = os.path.join(REPO, 'build', 'fuzz-coverage')
SEEDS = os.path.join(REPO, 'test', 'fuzz', 'corpus')
READERS = (
    'src/apps/region.cpp', 'src/bag/bag_file.cpp', 'src/bag/bag_messages.h', 'src/bag/bag_reader.cpp',
    'src/camera/camera_model.cpp', 'src/editing/map_selection.cpp', 'src/evaluation/experiment.cpp',
    'src/evaluation/unit_result.cpp', 'src/map/map_meta.cpp', 'src/map/map_reader.cpp', 'src/map/map_rows.cpp',
    'src/map/map_schema.cpp', 'src/node/reconfigure_server.cpp', 'src/parameters/yaml_map.cpp',
    'src/ros/image_conversion.cpp', 'src/ros/message_readers.cpp')


def run(command, **options):
    answer = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True,
                            errors='replace', check=False, **options)
    if answer.returncode != 0:
        sys.exit('%s ended with %d:\n%s' % (' '.join(command[:3]), answer.returncode, answer.stdout[-3000:]))
    return answer.stdout


def build(targets):
    print('building %s; takes minutes at first' % BUILD, file=sys.stderr)
    run(['cmake', '--preset', 'fuzz-coverage'], cwd=REPO)
    run(['cmake', '--build', BUILD, '--parallel', str(os.cpu_count()), '--target'] + ['replay_' + t for t in targets])


def program_of(target):
    return os.path.join(BUILD, 'fuzz', 'replay_' + target)


def replay(targets, corpora, folder):
    """Runs every target over its corpora; returns the merged counts."""
    counts = []
    for target in targets:
        counts.append(os.path.join(folder, target + '.profraw'))
        inputs = [os.path.join(corpus, target) for corpus in (corpora, SEEDS)]
        run([program_of(target)] + [path for path in inputs if os.path.isdir(path)],
            env=dict(os.environ, LLVM_PROFILE_FILE=counts[-1]))
    merged = os.path.join(folder, 'merged.profdata')
    run(['llvm-profdata', 'merge', '-sparse', '-o', merged] + counts)
    return merged


def lines_of(targets, merged):
    """How often each line of each reader ran, by file."""
    libraries = [os.path.join(BUILD, 'devel', 'lib', 'libvisual_localization_%s.so' % name) for name in ('core', 'ros')]
    objects = libraries + [program_of(target) for target in targets]
    report = run(['llvm-cov', 'export', '-format=lcov', '-instr-profile', merged, objects[0]]
                 + [argument for path in objects[1:] for argument in ('-object', path)]
                 + ['-ignore-filename-regex=^/usr/'])
    found = collections.defaultdict(dict)
    path = None
    for line in report.splitlines():
        if line.startswith('SF:'):
            # With ccache paths are relative to wherever the compiler ran.
            path = next((reader for reader in READERS if line.endswith('/' + reader)), None)
        elif line.startswith('DA:') and path:
            number, count = line[3:].split(',')[:2]
            found[path][int(number)] = max(int(count), found[path].get(int(number), 0))
    return found


def ranges(numbers):
    """'3, 5-7' of 3, 5, 6, 7."""
    spans = []
    for number in sorted(numbers):
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ', '.join(str(first) if first == last else '%d-%d' % (first, last) for first, last in spans)


def report(found):
    print('| file | lines reached | of | never reached |\n|---|---|---|---|')
    reached_in_all = lines_in_all = 0
    for path in READERS:
        counts = found.get(path)
        if not counts:
            sys.exit('%s: no target has a line of it' % path)
        missed = [number for number, count in counts.items() if count == 0]
        reached = len(counts) - len(missed)
        print('| `%s` | %.0f %% | %d | %s |' % (path, 100.0 * reached / len(counts), len(counts), ranges(missed)))
        reached_in_all += reached
        lines_in_all += len(counts)
    print('| all | %.1f %% | %d | |' % (100.0 * reached_in_all / lines_in_all, lines_in_all))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--corpus', default=os.path.join(REPO, 'build', 'fuzz', 'corpus'), metavar='DIR',
                        help='what scripts/fuzz.sh made (default: build/fuzz/corpus)')
    arguments = parser.parse_args()
    targets = sorted(os.listdir(SEEDS))
    build(targets)
    with tempfile.TemporaryDirectory() as folder:
        report(lines_of(targets, replay(targets, arguments.corpus, folder)))


if __name__ == '__main__':
    main()
