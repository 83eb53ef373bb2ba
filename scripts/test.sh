#!/usr/bin/env bash
# Installs what is missing, builds with warnings as errors, checks the style and runs every test.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo
# shellcheck source=scripts/build_progress.sh
source "$repo/scripts/build_progress.sh"

usage() {
  cat <<'USAGE'
Usage: test.sh [--preset NAME] [--tests REGEX] [--no-lint]
  --preset NAME  test (default), release, debug, asan, tsan, coverage, or core-only (without ROS)
  --tests REGEX  run only the suites and programs whose name matches
  --no-lint      leave out formatting, import directions and the checks of the scripts
Builds in build/NAME; the output of the build is in build/NAME.log. Exit code 0 when everything passed; tests that were
skipped are listed as such. A suite or a rostest without a report is an error.
USAGE
}

check_style() {
  step "Style"
  cd "$repo"
  find include src test \( -name '*.h' -o -name '*.cpp' \) -print0 | xargs -0 clang-format --dry-run -Werror
  echo "clang-format: clean"
  scripts/check_imports.py
  scripts/check_unity.py
  scripts/check_links.py
  shellcheck scripts/*.sh lab/*.sh .ci/run
  find scripts lab test -name '*.py' -print0 | xargs -0 python3 -c \
    'import ast, sys; [ast.parse(open(path, encoding="utf-8").read(), path) for path in sys.argv[1:]]'
  echo "scripts: clean"
}

# Builds a target, or everything.
make_target() {
  with_progress "build${1:+ $1}" "$log" cmake --build "$build" --parallel "$(nproc)" ${1:+--target "$1"} \
    || { show_errors "$log"; fail "the build failed: $log"; }
}

build() {
  step "Build ($preset)"
  cd "$repo"
  local version
  version=$(cmake --version | sed -n 's/^cmake version //p')
  [[ $(printf '%s\n' 3.25 "$version" | sort --version-sort | head -n 1) == 3.25 ]] \
    || fail "the presets need CMake 3.25, this is $version: configure by hand, as scripts/test_releases.sh does"
  cmake --preset "$preset" >>"$log" 2>&1 || { show_errors "$log"; fail "CMake failed: $log"; }
  make_target ''
  # catkin keeps the programs of its rostests out of `all`.
  local targets
  targets=$(cmake --build "$build" --target help)
  if grep -qx '\.\.\. tests' <<<"$targets"; then make_target tests; fi
}

run_tests() {
  step "Tests ($preset)"
  local result=0 arguments=(--preset "$preset" --parallel "$(nproc)" --output-junit "$build/ctest.xml")
  if [[ -n $tests ]]; then arguments+=(--tests-regex "$tests"); fi
  # Nothing of the caller's own ROS may reach the tests: rostest brings its own master.
  unset ROS_MASTER_URI ROS_HOSTNAME ROS_NAMESPACE
  export ROS_IP=127.0.0.1 ROS_HOME=$build/ros_home QT_QPA_PLATFORM=offscreen MPLBACKEND=Agg
  if [[ -f $build/devel/setup.bash ]]; then
    set +u
    # shellcheck disable=SC1091
    source "$build/devel/setup.bash"
    set -u
  fi
  cd "$repo"
  scripts/count_tests.py "$build" --clear
  ctest "${arguments[@]}" --no-tests=error || result=$?
  scripts/count_tests.py "$build" || result=1
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
  local build=$repo/build/$preset log=$repo/build/$preset.log

  echo "Installs what is missing, builds in build/$preset and runs the tests. To install and build takes 5 to 15"
  echo "minutes on two cores and 3 GB of disk the first time. Log: build/$preset.log"
  # Another python3 may stand first on the PATH; ROS needs the system's.
  export PATH=/usr/bin:$PATH
  mkdir -p "$repo/build"
  : >"$log"
  local packages=(--log "$log")
  if [[ $lint == true ]]; then packages+=(--with-lint); fi
  if [[ $preset == core-only ]]; then packages+=(--core-only); fi
  "$repo/scripts/install_dependencies.sh" "${packages[@]}"
  if [[ $lint == true ]]; then (check_style); fi
  (build)
  run_tests
}

main "$@"
