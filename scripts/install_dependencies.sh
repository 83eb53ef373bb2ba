#!/usr/bin/env bash
# Installs what is missing to build, test and run visual_localization on Debian 12.
set -euo pipefail

readonly ROS_BUILD=(
  catkin libroscpp-dev libnodelet-dev libnodeletlib-dev pluginlib-dev libcv-bridge-dev libimage-transport-dev
  libtf2-ros-dev libtf2-geometry-msgs-dev libtf2-eigen-dev librosbag-dev librosbag-storage-dev libroslz4-dev libbz2-dev libboost-dev
  libdiagnostic-updater-dev libdynamic-reconfigure-config-init-mutex-dev librostest-dev
  ros-message-generation ros-message-runtime
  # ros-*-msgs holds the definitions, lib*-msgs-dev the headers, python3-*-msgs the modules of the ROS tools.
  ros-std-msgs ros-sensor-msgs ros-geometry-msgs ros-nav-msgs ros-visualization-msgs ros-diagnostic-msgs ros-std-srvs
  libstd-msgs-dev libsensor-msgs-dev libgeometry-msgs-dev libnav-msgs-dev libvisualization-msgs-dev
  libdiagnostic-msgs-dev libstd-srvs-dev libtf2-msgs-dev
)
readonly ROS_RUN=(
  libnodeletlib-tools image-transport-tools rosout rosbash python3-rosbag python3-roslaunch python3-rosmaster
  python3-rosmsg python3-rosnode python3-rosparam python3-rospy python3-rosservice python3-rostest python3-rostopic
  python3-dynamic-reconfigure python3-nodelet python3-bond
  python3-std-msgs python3-sensor-msgs python3-geometry-msgs python3-nav-msgs python3-visualization-msgs
  python3-diagnostic-msgs python3-std-srvs python3-tf2-msgs python3-tf2-ros
)
readonly CORE=(
  cmake g++ make
  libopencv-dev libeigen3-dev libsqlite3-dev zlib1g-dev libnanoflann-dev libgeographiclib-dev libcli11-dev
  libyaml-cpp-dev libhwy-dev libgtest-dev libgmock-dev libbenchmark-dev
)
readonly PLOTS=(python3-matplotlib python3-yaml python3-numpy python3-opencv)
readonly LINT=(clang-format clang-tidy shellcheck)
readonly CLANG=(clang libclang-rt-dev)
readonly RVIZ=(rviz xvfb python3-tk)

usage() {
  cat <<'USAGE'
Usage: install_dependencies.sh [--with-lint] [--with-rviz] [--with-clang] [--core-only] [--list]
Installs with apt what is missing; does nothing when everything is there. Needs root or sudo only to install.
  --with-lint   also clang-format, clang-tidy and shellcheck
  --with-rviz   also rviz, a virtual display and what the window of plot_status.py needs
  --with-clang  also clang with its sanitizers and libFuzzer
  --core-only   only what the library without ROS needs
  --list        print the packages, one a line, and install nothing
USAGE
}

fail() {
  echo "install_dependencies: $*" >&2
  exit 1
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

# Installs the given packages.
install() {
  local log as_root=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || fail "neither root nor sudo to install what is missing: $*"
    as_root=(sudo)
  fi
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get --quiet --yes)
  log=$(mktemp)
  # The package lists may be new enough already; they are fetched only when the first attempt fails.
  if ! "${apt[@]}" install --no-install-recommends "$@" >"$log" 2>&1; then
    "${apt[@]}" update >"$log" 2>&1 || true
    if ! "${apt[@]}" install --no-install-recommends "$@" >>"$log" 2>&1; then
      local reason
      reason=$(grep -m1 '^E: ' "$log" || tail -n 1 "$log")
      fail "apt-get could not install $*: ${reason#E: } (whole output: $log)"
    fi
  fi
  rm -f "$log"
}

main() {
  local packages=("${CORE[@]}" "${ROS_BUILD[@]}" "${ROS_RUN[@]}" "${PLOTS[@]}") extra=() list=false
  while (($#)); do
    case $1 in
      --with-lint) extra+=("${LINT[@]}") ;;
      --with-clang) extra+=("${CLANG[@]}") ;;
      --with-rviz) extra+=("${RVIZ[@]}") ;;
      --core-only) packages=("${CORE[@]}") ;;
      --list) list=true ;;
      -h | --help) usage; exit 0 ;;
      *) usage >&2; exit 2 ;;
    esac
    shift
  done
  packages+=("${extra[@]}")

  if [[ $list == true ]]; then
    printf '%s\n' "${packages[@]}"
    exit 0
  fi
  command -v dpkg-query >/dev/null || fail "this is not a Debian system; install by hand: ${packages[*]}"

  local missing
  mapfile -t missing < <(missing_of "${packages[@]}")
  if ((${#missing[@]} > 0)); then
    echo "Installing ${#missing[@]} missing packages: ${missing[*]}"
    install "${missing[@]}"
  fi
}

main "$@"
