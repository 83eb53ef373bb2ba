#!/usr/bin/env bash
# Runs clang-tidy over the sources; the rules stand in .clang-tidy.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo

usage() {
  cat <<'USAGE'
Usage: tidy.sh [--changed [COMMIT]] [--build DIR] [FILE ...]
Checks the given files, or all of src/ and test/.
  --changed [COMMIT]  only files that differ from COMMIT (default: HEAD)
  --build DIR         a configured build folder (default: build/tidy, made when it is not there, without precompiled
                      headers and with each file alone)
USAGE
}

# The files to check, one a line, relative to the repository.
select_files() {
  if [[ -n $changed_since ]]; then
    {
      git -C "$repo" diff --name-only --diff-filter=d "$changed_since"
      git -C "$repo" ls-files --others --exclude-standard
    } | grep -E '^(src|test)/.*\.cpp$' || true
  else
    (cd "$repo" && find src test -name '*.cpp' | sort)
  fi
}

main() {
  local build=$repo/build/tidy changed_since='' files=()
  while (($#)); do
    case $1 in
      --changed)
        changed_since=HEAD
        if [[ ${2:-} && $2 != -* ]]; then changed_since=$2; shift; fi
        ;;
      --build) build=$(cd "${2:?--build needs a folder}" && pwd); shift ;;
      -h | --help) usage; exit 0 ;;
      -*) usage >&2; exit 2 ;;
      *) files+=("$(realpath --relative-to="$repo" "$1")") ;;
    esac
    shift
  done
  ((${#files[@]})) || mapfile -t files < <(select_files)

  export PATH=/usr/bin:$PATH
  "$repo/scripts/install_dependencies.sh" --with-lint
  if [[ ! -f $build/compile_commands.json ]]; then
    (cd "$repo" && cmake --preset debug -B "$build" -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null)
  fi
  # The headers of the messages; a build without ROS has none.
  local messages=visual_localization_generate_messages_cpp
  if cmake --build "$build" --target help | grep -q "$messages"; then
    cmake --build "$build" --target "$messages" >/dev/null
  fi
  # A file that the build does not know has no compiler options to check it with.
  local known=() unknown=() file
  for file in "${files[@]}"; do
    if grep -qF "\"$repo/$file\"" "$build/compile_commands.json"; then known+=("$repo/$file"); else unknown+=("$file"); fi
  done
  echo "clang-tidy: ${#known[@]} of ${#files[@]} files are part of the build"
  if [[ " ${unknown[*]-}" == *" src/"* ]]; then
    echo "clang-tidy: $build does not build each file of src/ alone: ${unknown[*]}" >&2
    exit 1
  fi
  ((${#known[@]})) || exit 0
  printf '%s\0' "${known[@]}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy -p "$build" --quiet
  echo "clang-tidy: clean"
}

main "$@"
