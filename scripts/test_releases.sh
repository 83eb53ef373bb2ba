#!/usr/bin/env bash
# Installs, builds, tests and packages the checkout's HEAD in bare trees of each Debian release. By hand and as root.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo
# shellcheck source=scripts/build_progress.sh
source "$repo/scripts/build_progress.sh"
# shellcheck source=scripts/bare_tree.sh
source "$repo/scripts/bare_tree.sh"
readonly releases=(bullseye bookworm trixie)
# Where the checkout and its build are in a tree; test.sh builds in the same folder.
readonly source_dir=/root/visual_localization build_dir=/root/visual_localization/build/test

usage() {
  cat <<'USAGE'
Usage: test_releases.sh [--release NAME]... [--directory DIR] [--mirror URL] [--jobs N] [--no-tests] [--keep]
                        [--reuse]
  --release NAME   bullseye, bookworm or trixie; may be repeated (default: all three)
  --directory DIR  for the trees and their logs (default: build/releases)
  --mirror URL     Debian mirror (default: that of this machine's apt)
  --jobs N         parallel jobs (default: number of processors)
  --no-tests       only the Debian package
  --keep           leave the trees when they have passed; those that failed are always left
  --reuse          use the trees that were left, with HEAD copied and built anew
Makes a bare tree with debootstrap, copies HEAD into it, and there runs scripts/install_dependencies.sh, the build with
warnings as errors, and all tests. For Debian 11 it first builds CLI11 and Highway from the source packages of
Debian 12. Then it builds a Debian package there, and installs and uses that in a second bare tree, DIR/NAME-package.
Needs debootstrap and 7 GB of disk a release. Prints one line of result a release; exit code 0 when all passed.
USAGE
}

copy_checkout() {
  rm -rf "$tree$source_dir" \
    && mkdir -p "$tree$source_dir" \
    && git -C "$repo" archive HEAD | tar --extract --directory "$tree$source_dir"
}

# Debian 11 has no package of CLI11 and Highway.
install_sources() {
  install --mode 644 /dev/stdin "$tree/etc/apt/sources.list.d/source.list" <<<"deb-src $mirror bookworm main" \
    && in_tree "apt-get update
    apt-get install --yes --no-install-recommends cmake g++ make dpkg-dev
    mkdir -p /root/sources
    cd /root/sources
    apt-get source cli11 highway
    $source_dir/scripts/install_from_source.sh cli11-*/ highway-*/"
}

install_packages() {
  in_tree "apt-get update && $source_dir/scripts/install_dependencies.sh"
}

configure() {
  in_tree "cmake -S $source_dir -B $build_dir -DCMAKE_BUILD_TYPE=RelWithDebInfo -DVISUAL_LOCALIZATION_WERROR=ON \
    -DPYTHON_EXECUTABLE=/usr/bin/python3"
}

# catkin keeps the programs of its tests out of `all`.
build() {
  in_tree "cmake --build $build_dir --parallel $jobs
    targets=\$(cmake --build $build_dir --target help)
    if grep -qx '\.\.\. tests' <<<\"\$targets\"; then cmake --build $build_dir --target tests --parallel $jobs; fi"
}

run_tests() {
  in_tree "cd $build_dir && ctest --output-on-failure --no-tests=error --parallel $jobs"
}

build_package() { in_tree "$source_dir/scripts/build_deb.sh --jobs $jobs"; }

# Runs one step after the other; the log holds everything.
run_steps() {
  local step
  for step in "$@"; do
    if ! with_progress "$release ${step//_/ }" "$log" "$step"; then
      results+=("$release: FAILED in ${step//_/ }; log $log, tree $tree")
      return 1
    fi
  done
}

test_release() {
  local steps=(make_tree copy_checkout) tree=$directory/$release log=$directory/$release.log tested='not tested'
  if [[ $release == bullseye ]]; then steps+=(install_sources); fi
  if [[ $reuse == true ]] && is_tree; then steps=(copy_checkout); fi
  steps+=(install_packages)
  if [[ $tests == true ]]; then steps+=(configure build run_tests); fi
  : >"$log"
  run_steps "${steps[@]}" build_package || return 1
  if [[ $tests == true ]]; then
    tested=$(grep -E 'tests passed, .* tests failed out of' "$log" | tail -n 1)
    tested+=", $(grep -cE '\*\*\*(Skipped|Not Run)' "$log" || true) skipped"
  fi

  local built=$tree package
  package=$(ls "$built$source_dir"/build/deb/*.deb)
  tree=$directory/$release-package
  steps=(make_tree)
  if [[ $reuse == true ]] && is_tree; then steps=(); fi
  run_steps "${steps[@]}" install_package try_package || return 1
  results+=("$release: $tested, the package works; log $log")
  if [[ $keep == true ]]; then return; fi
  for tree in "$tree" "$built"; do remove_tree; done
}

main() {
  local directory=$repo/build/releases mirror='' jobs tests=true keep=false reuse=false
  local chosen=() release results=() result=0
  jobs=$(nproc)
  while (($#)); do
    case $1 in
      --release)
        if [[ " ${releases[*]} " != *" ${2:-} "* ]]; then usage >&2; exit 2; fi
        chosen+=("$2")
        shift
        ;;
      --directory) directory=${2:?--directory needs a folder}; shift ;;
      --mirror) mirror=${2:?--mirror needs a URL}; shift ;;
      --jobs) jobs=${2:?--jobs needs a number}; shift ;;
      --no-tests) tests=false ;;
      --keep) keep=true ;;
      --reuse) reuse=true ;;
      -h | --help) usage; exit 0 ;;
      *) usage >&2; exit 2 ;;
    esac
    shift
  done
  ((${#chosen[@]})) || chosen=("${releases[@]}")
  if [[ -z $mirror ]]; then mirror=$(mirror_of_host); fi
  require_trees
  directory=$(realpath --canonicalize-missing "$directory")
  local tree
  for release in "${chosen[@]}"; do
    for tree in "$directory/$release" "$directory/$release-package"; do require_own_tree; done
  done
  mkdir -p "$directory"
  touch "$directory/CATKIN_IGNORE"

  echo "Tests $(git -C "$repo" log -1 --format='%h %s') on ${chosen[*]}. Logs: $directory/*.log"
  for release in "${chosen[@]}"; do test_release || result=1; done
  printf '%s\n' "${results[@]}"
  return "$result"
}

main "$@"
