#!/usr/bin/env bash
# Builds a map from one sample session and localises the other sample drive against it: nodelet, roscore, played bag.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo
# shellcheck source=scripts/build_progress.sh
source "$repo/scripts/build_progress.sh"
readonly image_topic=/stereo/left/image_raw

usage() {
  cat <<'USAGE'
Usage: demo.sh [--output DIR] [--rate FACTOR] [--map-bag BAG] [--bag BAG] [--tracker NAME] [--features NAME]
  --output DIR     folder for map, track, plot and logs (default: build/demo in the repository)
  --rate FACTOR    speed of playing over speed of recording, at most: it waits for the localizer (default: 6)
  --map-bag BAG    session to build the map from (default: the sunny sample)
  --bag BAG        drive to localise (default: the cloudy sample)
  --tracker NAME   bayes (default), dpso, dpso_multi, pf_gaussian, pf_linear
  --features NAME  sift (default), global, hybrid
Exit code 0 when the drive was localised and every image of its bag is accounted for.
USAGE
}

# Ends one process of ours and waits for it; harder when it does not listen.
stop() {
  local pid=$1 i
  kill -TERM "$pid" 2>/dev/null || return 0
  for ((i = 0; i < 150; i++)); do
    kill -0 "$pid" 2>/dev/null || break
    sleep 0.1
  done
  kill -KILL "$pid" 2>/dev/null || true
  wait "$pid" 2>/dev/null || true
}

# Ends what was started, the last one first.
started=()
clean_up() {
  local i
  for ((i = ${#started[@]} - 1; i >= 0; i--)); do stop "${started[i]}"; done
  started=()
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# wait_for SECONDS WHAT COMMAND...: until the command succeeds; fails when time is up or something we started has ended.
wait_for() {
  local end=$((SECONDS + $1)) what=$2 pid
  shift 2
  until "$@" >/dev/null 2>&1; do
    for pid in "${started[@]}"; do
      kill -0 "$pid" 2>/dev/null || fail "$what ended early; see the logs in $output"
    done
    ((SECONDS < end)) || fail "$what was not ready in time; see the logs in $output"
    sleep 0.2
  done
}

build() {
  step "Build (Release)"
  cmake -S "$repo" -B "$build" -DCMAKE_BUILD_TYPE=Release -DPYTHON_EXECUTABLE=/usr/bin/python3 \
    -DBUILD_TESTING=OFF -DCATKIN_ENABLE_TESTING=OFF >>"$log" 2>&1 || { show_errors "$log"; fail "CMake failed: $log"; }
  with_progress build "$log" cmake --build "$build" --parallel "$(nproc)" \
    || { show_errors "$log"; fail "the build failed: $log"; }
  echo "built in ${build#"$PWD"/}"
}

build_map() {
  step "Map from $(basename "$map_bag")"
  "$programs/map_builder" --bag "$map_bag" --image-topic "$image_topic" --fix-topic /gps/fix \
    --output "$output/campus.map" || fail "map_builder failed"
  "$programs/map_info" "$output/campus.map" --export-csv "$output/map.csv" || fail "map_info failed"
}

free_port() {
  python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

start_master() {
  local port
  port=$(free_port)
  export ROS_MASTER_URI=http://127.0.0.1:$port ROS_IP=127.0.0.1 ROS_HOME=$output/ros ROS_LOG_DIR=$output/ros/log
  unset ROS_HOSTNAME ROS_NAMESPACE
  roscore -p "$port" >"$output/roscore.log" 2>&1 &
  started+=($!)
  wait_for 30 roscore rosparam get /rosversion
  rosparam set use_sim_time true
}

start_localizer() {
  roslaunch --wait visual_localization localizer.launch map:="$output/campus.map" image:="$image_topic" \
    image_transport:=compressed tracker:="$tracker" features:="$features" >"$output/localizer.log" 2>&1 &
  started+=($!)
}

localize() {
  step "Localise $(basename "$bag") at up to $rate times its speed"
  start_master
  start_localizer
  rm -f "$output/ready" "$output/track.csv" "$output/track.json"
  python3 "$repo/scripts/record_track.py" --bag "$bag" --output "$output/track.csv" --ready "$output/ready" &
  local recorder=$!
  started+=("$recorder")
  wait_for 60 "the localizer" test -e "$output/ready"

  # Only the images are played: the localizer shall see nothing else.
  python3 "$repo/scripts/play_drive.py" --bag "$bag" --rate "$rate" --image-topic "$image_topic" \
    --topics "$image_topic/compressed" >"$output/play.log" 2>&1 &
  local player=$!
  started+=("$player")
  wait "$player" || fail "the drive could not be played: $output/play.log"
  wait "$recorder" || fail "nothing was recorded; see $output/localizer.log"
}

main() {
  local output=$repo/build/demo rate=6 tracker=bayes features=sift
  local map_bag=$repo/test/data/rounds/campus_sunny_1.bag bag=$repo/test/data/rounds/campus_cloudy_1.bag
  while (($#)); do
    case $1 in
      -h | --help) usage; exit 0 ;;
      --output) output=${2:?--output needs a folder} ;;
      --rate) rate=${2:?--rate needs a number} ;;
      --map-bag) map_bag=$(realpath "${2:?--map-bag needs a bag}") ;;
      --bag) bag=$(realpath "${2:?--bag needs a bag}") ;;
      --tracker) tracker=${2:?--tracker needs a name} ;;
      --features) features=${2:?--features needs a name} ;;
      *) usage >&2; exit 2 ;;
    esac
    shift 2
  done
  mkdir -p "$output"
  output=$(cd "$output" && pwd)
  local build=$repo/build/demo_release programs=$repo/build/demo_release/devel/lib/visual_localization
  local log=$output/build.log

  echo "Installs what is missing, builds in ${build#"$PWD"/}, builds a map from $(basename "$map_bag")"
  echo "and localises $(basename "$bag") against it. To install and build takes 5 to 15 minutes on two cores and"
  echo "3 GB of disk the first time. Log: ${log#"$PWD"/}"
  # Another python3 may stand first on the PATH; ROS needs the system's.
  export PATH=/usr/bin:$PATH MPLBACKEND=Agg
  : >"$log"
  "$repo/scripts/install_dependencies.sh" --log "$log"
  build
  set +u
  # shellcheck disable=SC1091
  source "$build/devel/setup.bash"
  set -u
  build_map
  localize
  clean_up

  step "The same without landmarks, for the plot"
  "$programs/localize" --map "$output/campus.map" --bag "$bag" --image-topic "$image_topic" --tracker "$tracker" \
    --features "$features" --pose-source place --output "$output/places.csv" || fail "localize failed"

  step "Result"
  python3 "$repo/scripts/report_track.py" "$output/track.csv" --map-csv "$output/map.csv" --places "$output/places.csv"
}

main "$@"
