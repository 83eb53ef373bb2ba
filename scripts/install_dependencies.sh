#!/usr/bin/env bash
# Installs what is missing to build, test and run visual_localization on Debian 11, 12 and 13.
set -euo pipefail
scripts=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
readonly scripts
# shellcheck source=scripts/build_progress.sh
source "$scripts/build_progress.sh"

# Packages by their names in Debian 12, and after the colon what they are needed for.
readonly CORE='
cmake g++ make: the build
libopencv-dev: images
libeigen3-dev: vectors and matrices
libsqlite3-dev zlib1g-dev: map files
libceres-dev: adjustment of landmarks and poses
libnanoflann-dev: search for the training images near a position
libgeographiclib-dev: GPS positions to metres
libcli11-dev: command lines of the programs
libboost-dev: polygons; bags; HTML pages
libjpeg-dev libpng-dev libturbojpeg0-dev: previews, masks, compressed images
libyaml-cpp-dev: configuration files
nlohmann-json3-dev: GeoJSON export of maps, HTML pages
libhwy-dev: vectorised SIFT and comparison of descriptors
libgtest-dev libgmock-dev: tests
libbenchmark-dev: benchmarks'
readonly ROS_BUILD='
catkin: the build of a ROS package
libroscpp-dev libnodelet-dev libnodeletlib-dev pluginlib-dev: the nodelet
libcv-bridge-dev libimage-transport-dev: images from a camera
libcamera-calibration-parsers-dev: calibration files of cameras
libtf2-ros-dev libtf2-geometry-msgs-dev libtf2-eigen-dev: tf
librosbag-dev librosbag-storage-dev libroslz4-dev libbz2-dev: bags
libdiagnostic-updater-dev: diagnostics
libdynamic-reconfigure-config-init-mutex-dev: parameters that change while it runs
librostest-dev python3-rostest: tests of the running node
parallel: tests of maps of many bags
ros-message-generation ros-message-runtime: messages of this package
ros-std-msgs ros-sensor-msgs ros-geometry-msgs ros-nav-msgs: definitions of messages
ros-visualization-msgs ros-diagnostic-msgs ros-std-srvs: definitions of messages
libstd-msgs-dev libsensor-msgs-dev libgeometry-msgs-dev libnav-msgs-dev: C++ headers of messages
libvisualization-msgs-dev libdiagnostic-msgs-dev libstd-srvs-dev libtf2-msgs-dev: C++ headers of messages'
readonly ROS_RUN='
libnodeletlib-tools python3-nodelet python3-bond: nodelet managers
image-transport-tools: image_transport republish
topic-tools: rosrun topic_tools throttle
rosout rosbash python3-roslaunch python3-rosmaster: roscore, rosrun and roslaunch
python3-rosbag: rosbag play and the scripts that read bags
python3-rosmsg python3-rosnode python3-rosparam python3-rosservice python3-rostopic: tools of the command line
python3-rospy python3-tf2-ros: scripts that talk to the node
python3-dynamic-reconfigure: rosrun dynamic_reconfigure dynparam
python3-std-msgs python3-sensor-msgs python3-geometry-msgs python3-nav-msgs: Python modules of messages
python3-visualization-msgs python3-diagnostic-msgs python3-std-srvs python3-tf2-msgs: Python modules of messages'
readonly PLOTS='
python3-matplotlib python3-numpy: plots
python3-yaml: configuration files in scripts
python3-opencv python3-pil: images in scripts'
readonly LINT='
clang-format clang-tidy shellcheck: checks of style'
readonly CLANG='
clang libclang-rt-dev llvm: fuzzing
python3-clang: mutation testing'
readonly PACKAGING='
file dpkg-dev: the libraries that a Debian package needs'
readonly MODELS='
python3-torch: export of learned features
python3-onnx: the tiny model of the tests'
readonly BROWSER='
chromium chromium-driver python3-selenium: tests of the HTML pages'
readonly RVIZ='
rviz xvfb: rviz and a virtual display
python3-tk: the window of plot_status.py'

# Debian 11: other names; empty where there is no package of it.
readonly -A DEBIAN_11=(
  [libgeographiclib-dev]=libgeographic-dev [libcli11-dev]='' [libhwy-dev]='' [libclang-rt-dev]=libclang-common-11-dev
)

usage() {
  cat <<'USAGE'
Usage: install_dependencies.sh [--with-lint] [--with-rviz] [--with-clang] [--with-packaging]
                               [--with-models] [--with-browser] [--core-only | --run-only] [--list] [--log FILE]
Installs with apt what is missing; does nothing when everything is there. Needs root or sudo only to install.
Before it installs, it prints what is missing, what for, and the command for root.
  --with-lint       also clang-format, clang-tidy and shellcheck
  --with-rviz       also rviz, a virtual display and what the window of plot_status.py needs
  --with-clang      also clang with its sanitizers and libFuzzer
  --with-packaging  also what build_deb.sh needs
  --with-models     also what export_features.py and its test need (0.2 GB)
  --with-browser    also Chromium, in which the HTML pages are tested (0.3 GB)
  --core-only       only what the library without ROS needs
  --run-only        only what the built package runs, beside the libraries that it is linked with
  --list            print the packages, one a line, and install nothing
  --log FILE        add apt's output to FILE (default: a temporary file, kept when apt fails)
USAGE
}

# "debian 12", or whatever else this is.
release() (
  # shellcheck disable=SC1091
  if [[ -r /etc/os-release ]]; then source /etc/os-release; fi
  echo "${ID:-unknown} ${VERSION_ID:-}"
)

# Reads tables into `packages` and `reasons`, with the names of this release.
read_tables() {
  local is_debian_11=$1 names reason name
  while IFS=: read -r names reason; do
    for name in $names; do
      if [[ $is_debian_11 == true ]]; then name=${DEBIAN_11[$name]-$name}; fi
      if [[ -z $name ]]; then continue; fi
      packages+=("$name")
      reasons[$name]=${reason# }
    done
  done
}

# Prints those of the given packages that are not installed, one a line.
missing_of() {
  local installed package
  # dpkg-query fails when it has never heard of one of them; that one is then missing like the others.
  installed=$(dpkg-query --show --showformat='${db:Status-Status} ${Package}\n' "$@" 2>/dev/null) || true
  for package in "$@"; do
    grep -qxF "installed $package" <<<"$installed" || echo "$package"
  done
}

# Whether a header can be included, from wherever CMake looks too.
has_header() {
  local prefix prefixes
  IFS=: read -ra prefixes <<<"${CMAKE_PREFIX_PATH:-}"
  for prefix in "${prefixes[@]}" /usr /usr/local; do
    if [[ -e $prefix/include/$1 ]]; then return 0; fi
  done
  return 1
}

# Names what Debian 11 has no package of and how to get it. Fails without CLI11, which the build needs.
check_sources() {
  local cli11=true highway=true
  has_header CLI/CLI.hpp || cli11=false
  has_header hwy/highway.h || highway=false
  if [[ $cli11 == true && $highway == true ]]; then return 0; fi
  echo "Debian 11 has no package of:"
  [[ $cli11 == true ]] || echo "  CLI11, from 1.9: command lines of the programs"
  [[ $highway == true ]] || echo "  Highway, 1.x: vectorised SIFT and comparison of descriptors; both slow without"
  cat <<SOURCES
Get the sources and let root install them:
  git clone --branch v2.3.2 https://github.com/CLIUtils/CLI11
  git clone --branch 1.0.7 https://github.com/google/highway
  $scripts/install_from_source.sh CLI11 highway
SOURCES
  [[ $cli11 == true ]]
}

# Prints what is missing, each with its reason, and the command for root.
print_missing() {
  local package
  echo "$# packages are missing:"
  for package in "$@"; do printf '  %-36s %s\n' "$package" "${reasons[$package]}"; done
  echo "As root: apt-get update && apt-get install --yes --no-install-recommends $*"
}

# Installs the given packages; apt's output goes to `log`.
install() {
  local as_root=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || fail "neither root nor sudo: let root run the command above"
    as_root=(sudo)
  fi
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get --quiet --yes -o APT::Status-Fd=1)
  # The package lists may be new enough already; they are fetched only when the first attempt fails.
  if ! with_progress install "$log" "${apt[@]}" install --no-install-recommends "$@"; then
    "${apt[@]}" update >>"$log" 2>&1 || true
    if ! with_progress install "$log" "${apt[@]}" install --no-install-recommends "$@"; then
      local reason
      reason=$(grep '^E: ' "$log" | tail -n 1) || reason=$(tail -n 1 "$log")
      fail "apt-get could not install everything: ${reason#E: } (whole output: $log)"
    fi
  fi
}

main() {
  local tables=("$CORE" "$ROS_BUILD" "$ROS_RUN" "$PLOTS") extra=() list=false log=''
  while (($#)); do
    case $1 in
      --with-lint) extra+=("$LINT") ;;
      --with-clang) extra+=("$CLANG") ;;
      --with-rviz) extra+=("$RVIZ") ;;
      --with-packaging) extra+=("$PACKAGING") ;;
      --with-models) extra+=("$MODELS") ;;
      --with-browser) extra+=("$BROWSER") ;;
      --core-only) tables=("$CORE") ;;
      --run-only) tables=("$ROS_RUN" "$PLOTS") ;;
      --list) list=true ;;
      --log) log=${2:?--log needs a file}; shift ;;
      -h | --help) usage; exit 0 ;;
      *) usage >&2; exit 2 ;;
    esac
    shift
  done
  local packages=() is_debian_11=false
  local -A reasons=()
  if [[ $(release) == 'debian 11' ]]; then is_debian_11=true; fi
  read_tables "$is_debian_11" < <(printf '%s\n' "${tables[@]}" "${extra[@]}")

  if [[ $list == true ]]; then
    printf '%s\n' "${packages[@]}"
    exit 0
  fi
  command -v dpkg-query >/dev/null || fail "this is not a Debian system; install by hand: ${packages[*]}"

  local missing
  mapfile -t missing < <(missing_of "${packages[@]}")
  local complete=true
  if [[ $is_debian_11 == true ]]; then check_sources || complete=false; fi
  if ((${#missing[@]} > 0)); then
    print_missing "${missing[@]}"
    local temporary=''
    if [[ -z $log ]]; then log=$(mktemp) temporary=$log; fi
    install "${missing[@]}"
    if [[ -n $temporary ]]; then rm -f "$temporary"; fi
  fi
  [[ $complete == true ]] || fail "CLI11 is missing; how to get it stands above"
}

main "$@"
