#!/usr/bin/env bash
# Builds a Debian package of the checkout for the release of this machine, and tries it in a bare tree.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo build=$repo/build/deb
# shellcheck source=scripts/build_progress.sh
source "$repo/scripts/build_progress.sh"
# shellcheck source=scripts/bare_tree.sh
source "$repo/scripts/bare_tree.sh"

usage() {
  cat <<'USAGE'
Usage: build_deb.sh [--jobs N] [--try DIR [--mirror URL]]
Installs what the build lacks and builds build/deb/visual-localization_VERSION_MACHINE.deb: everything for /usr, with
the packages of Debian that it needs. Install it with `apt-get install ./FILE.deb`.
  --jobs N      parallel jobs (default: number of processors)
  --try DIR     makes a bare tree of this Debian release in DIR, as root with debootstrap, installs the package there
                and uses it: builds a map, localises with the programs and with the nodelet, loads the installed
                launch files. A tree that is there is used again; any other folder
                that is not empty is refused
  --mirror URL  Debian mirror (default: that of this machine's apt)
USAGE
}

# Nothing of a workspace that is sourced may come in.
build_package() {
  unset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH PYTHONPATH
  cmake -S "$repo" -B "$build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DBUILD_TESTING=OFF \
    -DVISUAL_LOCALIZATION_LIB_DESTINATION="lib/$(g++ -print-multiarch)" -DCATKIN_BUILD_BINARY_PACKAGE=1 \
    -DPYTHON_EXECUTABLE=/usr/bin/python3 \
    -DVISUAL_LOCALIZATION_DEB_DEPENDS="${depends//$'\n'/, }" \
    && cmake --build "$build" --parallel "$jobs" \
    && rm -f "$build"/*.deb \
    && (cd "$build" && cpack) \
    && rm -rf "$build/_CPack_Packages"  # roslaunch would find each launch file twice in this checkout
}

main() {
  local jobs tree='' mirror='' release log=$build/build.log step depends
  jobs=$(nproc)
  while (($#)); do
    case $1 in
      --jobs) jobs=${2:?--jobs needs a number}; shift ;;
      --try) tree=${2:?--try needs a folder}; shift ;;
      --mirror) mirror=${2:?--mirror needs a URL}; shift ;;
      -h | --help) usage; exit 0 ;;
      *) usage >&2; exit 2 ;;
    esac
    shift
  done
  export PATH=/usr/bin:$PATH
  if [[ -n $tree ]]; then
    if [[ -z $mirror ]]; then mirror=$(mirror_of_host); fi
    require_trees
    mkdir -p "$(dirname "$tree")"
    tree=$(cd "$(dirname "$tree")" && pwd)/$(basename "$tree")
    require_own_tree
  fi
  "$repo/scripts/install_dependencies.sh" --with-packaging
  depends=$("$repo/scripts/install_dependencies.sh" --run-only --list)
  mkdir -p "$build"
  : >"$log"
  with_progress "build the package" "$log" build_package || fail "the package was not built; log $log"
  echo "$(ls "$build"/*.deb): $(du -h "$build"/*.deb | cut -f 1)"
  if [[ -z $tree ]]; then return; fi
  # shellcheck disable=SC1091
  release=$(. /etc/os-release && echo "$VERSION_CODENAME")
  local package
  package=$(ls "$build"/*.deb)
  local steps=(install_package try_package)
  if ! is_tree; then steps=(make_tree "${steps[@]}"); fi
  for step in "${steps[@]}"; do
    with_progress "${step//_/ }" "$log" "$step" || fail "failed in ${step//_/ }; log $log, tree $tree"
  done
  tail -n 1 "$log"
}

main "$@"
