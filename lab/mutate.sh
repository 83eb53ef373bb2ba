#!/usr/bin/env bash
# Mutation testing: changes the code in small ways, one at a time, and asks whether a test fails.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo work=$repo/build/mutation
folders=(localization geo)
tests=(localization geo)

usage() {
  cat <<'USAGE'
Usage: mutate.sh [--sample N] [--seed N] [--jobs N] [--resume] [--test FOLDER ...]
Puts mutants into a copy of src/localization and src/geo: comparisons, arithmetic, constants, conditions and limits are
changed, and calls and assignments left out. All are in one build; then the tests that reach a mutant run with it,
until one fails. Needs python3-clang (install_dependencies.sh --with-clang).
  --sample N  only N mutants, chosen at random (default: all)
  --seed N    of that choice (default: 1)
  --jobs N    mutants at a time (default: the number of cores)
  --resume    keep the outcomes of a run before; they hold for the code and tests of that run
  --test F    test programs of these folders, until the end of the line (default: localization geo)
Writes build/mutation/outcomes.jsonl and build/mutation/report.md. With two cores: about 10 minutes to build, more
than an hour to run all. Exit code 0 when the run is complete, whatever survived.
USAGE
}

# A copy of the checkout as it is, without what git ignores, so that the mutants never stand in the sources. Hidden, or
# roslaunch would find each launch file twice in this checkout.
copy_sources() {
  rm -rf "$work/.source"
  mkdir -p "$work/.source"
  git -C "$repo" ls-files -z --cached --others --exclude-standard | (cd "$repo" && while IFS= read -r -d '' file; do
    if [[ -f $file ]]; then printf '%s\0' "$file"; fi  # not one that was deleted
  done | xargs -0 cp --parents -t "$work/.source")
}

main() {
  local options=()
  while (($#)); do
    case $1 in
      --sample) options+=(--sample "${2:?--sample needs a number}"); shift ;;
      --seed) options+=(--seed "${2:?--seed needs a number}"); shift ;;
      --jobs) options+=(--jobs "${2:?--jobs needs a number}"); shift ;;
      --resume) options+=(--resume) ;;
      --test) shift; tests=("$@"); break ;;
      -h | --help) usage; exit 0 ;;
      *) usage >&2; exit 2 ;;
    esac
    shift
  done
  export PATH=/usr/bin:$PATH
  local build=$work/build programs=()
  copy_sources
  cmake -S "$work/.source" -B "$build" -DCMAKE_BUILD_TYPE=Release -DVISUAL_LOCALIZATION_ROS=OFF \
    -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
    '-DCMAKE_CXX_FLAGS=-w -D_GLIBCXX_ASSERTIONS' -DCMAKE_CXX_FLAGS_RELEASE=-O2
  "$repo/lab/mutants.py" --source "$work/.source" --build "$build" --out "$work/mutants.json" "${folders[@]}"
  cmake --build "$build" --parallel "$(nproc)" --target "${tests[@]/#/test_}"
  for test in "${tests[@]}"; do programs+=("$build/test/test_$test"); done
  "$repo/lab/mutant_outcomes.py" run --mutants "$work/mutants.json" --out "$work/outcomes.jsonl" "${options[@]}" \
    "${programs[@]}"
  "$repo/lab/mutant_outcomes.py" report "$work/outcomes.jsonl" >"$work/report.md"
  sed '/^$/,$d' "$work/report.md"
  echo "survivors: $work/report.md"
}

main "$@"
