#!/usr/bin/env bash
# Builds and installs CLI11, Highway and nanoflann from their sources, where the system has no package of them.
set -euo pipefail
scripts=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
readonly scripts
# shellcheck source=scripts/build_progress.sh
source "$scripts/build_progress.sh"

usage() {
  cat <<'USAGE'
Usage: install_from_source.sh [--prefix DIR] SOURCE_DIR ...
  --prefix DIR  where to install (default: /usr/local, needs root); name another one to CMake by CMAKE_PREFIX_PATH
Each SOURCE_DIR holds the sources of CLI11 (from 1.9), Highway (1.x) or nanoflann (from 1.3), as from
  git clone --branch v2.3.2 https://github.com/CLIUtils/CLI11
  git clone --branch 1.0.7 https://github.com/google/highway
  git clone --branch v1.4.3 https://github.com/jlblancoc/nanoflann
USAGE
}

# The code is for a shared library; tests, examples and pages are left out.
install_one() {
  local source=$1 build=$2 log=$2.log
  {
    cmake -S "$source" -B "$build" --no-warn-unused-cli -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$prefix" \
      -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DBUILD_TESTING=OFF -DHWY_ENABLE_EXAMPLES=OFF -DHWY_ENABLE_CONTRIB=OFF \
      -DCLI11_BUILD_EXAMPLES=OFF -DCLI11_BUILD_DOCS=OFF -DNANOFLANN_BUILD_EXAMPLES=OFF -DNANOFLANN_BUILD_TESTS=OFF
    cmake --build "$build" --parallel "$(nproc)"
    cmake --install "$build"
  } >"$log" 2>&1 || { tail -n 20 "$log" >&2; fail "$source: not installed"; }
  echo "installed $(basename "$source") in $prefix"
}

main() {
  local prefix=/usr/local sources=()
  while (($#)); do
    case $1 in
      --prefix) prefix=$(realpath -m "${2:?--prefix needs a folder}"); shift ;;
      -h | --help) usage; exit 0 ;;
      -*) usage >&2; exit 2 ;;
      *) sources+=("$1") ;;
    esac
    shift
  done
  ((${#sources[@]})) || { usage >&2; exit 2; }

  local source
  for source in "${sources[@]}"; do
    [[ $(basename "$source") =~ ^[[:alnum:]][[:alnum:]._+-]*$ ]] \
      || fail "${source@Q} does not end with a plain name of a folder: a letter or digit, then also . _ + -"
    [[ -f $source/CMakeLists.txt ]] || fail "$source is not the folder of a CMake project"
  done
  builds=$(mktemp -d)
  trap 'rm -rf "$builds"' EXIT
  for source in "${sources[@]}"; do install_one "$source" "$builds/$(basename "$source")"; done
}

main "$@"
