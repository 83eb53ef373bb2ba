#!/usr/bin/env bash
# Installs what is missing, builds with warnings as errors, checks the style and runs every test.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo

usage() {
  cat <<'USAGE'
Usage: test.sh [--preset NAME] [--tests REGEX] [--no-lint]
  --preset NAME  test (default), release, debug, asan, tsan, coverage, or core-only (without ROS)
  --tests REGEX  run only the tests whose name matches
  --no-lint      leave out formatting, import directions and the checks of the scripts
Builds in build/NAME. Exit code 0 when everything passed; tests that were skipped are listed as such.
USAGE
}

step() { printf '\n== %s\n' "$*"; }

check_style() {
  step "Style"
  cd "$repo"
  find include src test \( -name '*.h' -o -name '*.cpp' \) -print0 | xargs -0 clang-format --dry-run -Werror
  echo "clang-format: clean"
  scripts/check_imports.py
  shellcheck scripts/*.sh .ci/run
  find scripts test -name '*.py' -print0 | xargs -0 python3 -c \
    'import ast, sys; [ast.parse(open(path, encoding="utf-8").read(), path) for path in sys.argv[1:]]'
  echo "scripts: clean"
}

build() {
  step "Build ($preset)"
  cd "$repo"
  cmake --preset "$preset" >"$build.configure.log" 2>&1 || { cat "$build.configure.log"; exit 1; }
  cmake --build "$build" --parallel "$(nproc)"
  # catkin keeps the programs of its rostests out of `all`.
  local targets
  targets=$(cmake --build "$build" --target help)
  if grep -qx '\.\.\. tests' <<<"$targets"; then
    cmake --build "$build" --target tests --parallel "$(nproc)"
  fi
}

# Prints how many single tests ran, from the reports of ctest and of rostest.
print_counts() {
  python3 - "$build" <<'PYTHON'
import sys, xml.etree.ElementTree as xml
from pathlib import Path

def is_skipped(case):
    return case.find('skipped') is not None or case.get('status') == 'notrun' or case.get('result') == 'skipped'

def is_failed(case):
    return case.find('failure') is not None or case.find('error') is not None

def show(title, paths):
    cases = [case for path in paths for case in xml.parse(path).iter('testcase')]
    skipped, failed = [sum(map(test, cases)) for test in (is_skipped, is_failed)]
    print(f'{title}: {len(cases)} tests, {len(cases) - failed - skipped} passed, {failed} failed, {skipped} skipped')
    return [case for case in cases if is_skipped(case)]

build = Path(sys.argv[1])
show('ctest', [build / 'ctest.xml'])
reports = sorted(build.glob('test_results/**/rosunit-*.xml'))
if reports:
    for case in show('inside the rostests', reports):
        print(f'  skipped: {case.get("classname")}.{case.get("name")}')
PYTHON
}

run_tests() {
  step "Tests ($preset)"
  local result=0 arguments=(--preset "$preset" --parallel "$(nproc)" --output-junit "$build/ctest.xml")
  if [[ -n $tests ]]; then arguments+=(--tests-regex "$tests"); fi
  # Nothing of the caller's own ROS may reach the tests: rostest brings its own master.
  unset ROS_MASTER_URI ROS_HOSTNAME ROS_NAMESPACE
  export ROS_IP=127.0.0.1 ROS_HOME=$build/ros_home QT_QPA_PLATFORM=offscreen MPLBACKEND=Agg
  rm -rf "$build/test_results"
  if [[ -f $build/devel/setup.bash ]]; then
    set +u
    # shellcheck disable=SC1091
    source "$build/devel/setup.bash"
    set -u
  fi
  cd "$repo"
  ctest "${arguments[@]}" --no-tests=error || result=$?
  print_counts
  return "$result"
}

main() {
  local preset=test tests='' lint=true
  while (($#)); do
    case $1 in
      --preset) preset=${2:?--preset needs a name}; shift ;;
      --tests) tests=${2:?--tests needs a regular expression}; shift ;;
      --no-lint) lint=false ;;
      -h | --help) usage; exit 0 ;;
      *) usage >&2; exit 2 ;;
    esac
    shift
  done
  local build=$repo/build/$preset

  # Another python3 may stand first on the PATH; ROS needs the system's.
  export PATH=/usr/bin:$PATH
  mkdir -p "$repo/build"
  local packages=()
  if [[ $lint == true ]]; then packages+=(--with-lint); fi
  if [[ $preset == core-only ]]; then packages+=(--core-only); fi
  "$repo/scripts/install_dependencies.sh" "${packages[@]}"
  if [[ $lint == true ]]; then (check_style); fi
  (build)
  run_tests
}

main "$@"
