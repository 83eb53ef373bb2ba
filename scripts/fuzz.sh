#!/usr/bin/env bash
# Builds the libFuzzer programs of test/fuzz with clang and runs them.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo build=$repo/build/fuzz
readonly targets=(map model bag config camera reconfigure edits unit_result services sensors records images)

usage() {
  cat <<USAGE
Usage: fuzz.sh [--seconds N] [TARGET ...]
Runs each target (default: all, one after the other) under AddressSanitizer and UndefinedBehaviorSanitizer:
${targets[*]}
  --seconds N  how long each target runs (default: 60)
What is found is kept in build/fuzz/findings, new inputs in build/fuzz/corpus; those that ship are in test/fuzz/corpus.
Prints a table at the end, its rates in executions per second of processor time; scripts/fuzz_coverage.py says what was
reached. Exit code 0 when nothing was found.
USAGE
}

# Runs one target for so many seconds; fails when it finds something.
fuzz() {
  local target=$1 seconds=$2 corpus=$build/corpus/$1 findings=$build/findings/$1 length=4096
  local dictionary=$repo/test/fuzz/dictionaries/$target.dict options=()
  if [[ $target == map || $target == bag ]]; then length=65536; fi
  if [[ -e $dictionary ]]; then options+=("-dict=$dictionary"); fi
  printf '\n== %s, %s s\n' "$target" "$seconds"
  mkdir -p "$corpus" "$findings" "$build/log"
  local TIMEFORMAT='%U %S'
  # An allocation that is refused is std::bad_alloc, as without the sanitizer, and so the reader's own business. The
  # other options keep the sanitizer's own bookkeeping small.
  local -x UBSAN_OPTIONS=print_stacktrace=1
  local -x ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1:max_allocation_size_mb=4000:malloc_context_size=2:quarantine_size_mb=16:max_malloc_fill_size=0
  { time "$build/fuzz/fuzz_$target" -max_total_time="$seconds" -timeout=60 -rss_limit_mb=4096 -max_len="$length" \
    -entropic=0 -print_final_stats=1 -verbosity=1 -artifact_prefix="$findings/" "${options[@]}" "$corpus" \
    "$repo/test/fuzz/corpus/$target" 2>&1 | tee "$build/log/$target.txt"; } 2>"$build/log/$target.seconds"
}

# One row of the table.
summary() {
  awk -v target="$1" '
    FILENAME ~ /seconds$/ { seconds = $1 + $2; next }
    /^#[0-9]+.* cov: / { for (i = 1; i < NF; ++i) if ($i == "cov:") edges = $(i + 1) }
    /number_of_executed_units/ { executions = $2 }
    END { printf "| %s | %d | %d | %d |\n", target, executions, executions / seconds, edges }' \
    "$build/log/$1.seconds" "$build/log/$1.txt"
}

main() {
  local seconds=60 chosen=()
  while (($#)); do
    case $1 in
      --seconds) seconds=${2:?--seconds needs a number}; shift ;;
      -h | --help) usage; exit 0 ;;
      *)
        if [[ " ${targets[*]} " != *" $1 "* ]]; then usage >&2; exit 2; fi
        chosen+=("$1")
        ;;
    esac
    shift
  done
  ((${#chosen[@]})) || chosen=("${targets[@]}")

  export PATH=/usr/bin:$PATH
  "$repo/scripts/install_dependencies.sh" --with-clang
  cd "$repo"
  mkdir -p "$build"
  cmake --preset fuzz >"$build/configure.log" || { cat "$build/configure.log"; exit 1; }
  cmake --build "$build" --parallel "$(nproc)" --target "${chosen[@]/#/fuzz_}"
  local target result=0
  for target in "${chosen[@]}"; do fuzz "$target" "$seconds" || result=1; done
  printf '\n| target | executions | a second | edges |\n|---|---|---|---|\n'
  for target in "${chosen[@]}"; do summary "$target"; done
  return "$result"
}

main "$@"
