#!/usr/bin/env bash
# Uses an installed visual_localization as a user would, with the recordings that come with it. Ends with one line.
set -euo pipefail
work=${1:?Usage: try_installed.sh FOLDER}

# wait_for WHAT COMMAND...: until it succeeds, at most a minute.
wait_for() {
  local what=$1 deadline=$((SECONDS + 60))
  shift
  until "$@" >/dev/null 2>&1; do
    if ((SECONDS > deadline)); then
      echo "no $what after a minute" >&2
      exit 1
    fi
    sleep 0.2
  done
}

mkdir -p "$work"
cd "$work"
work=$PWD
export ROS_PACKAGE_PATH=/usr/share ROS_IP=127.0.0.1 ROS_MASTER_URI=http://127.0.0.1:11391 ROS_HOME=$work/ros
share=$(rospack find visual_localization)
rounds=$share/test/data/rounds

rosrun visual_localization map_builder --bag "$rounds/campus_sunny_1.bag" --output round.map --plot round.png
rosrun visual_localization map_info round.map --check
rosrun visual_localization localize --map round.map --bag "$rounds/campus_cloudy_1.bag" --output track.csv \
  --truth-topic /ground_truth/fix
rosrun visual_localization evaluate --config "$share/config/evaluation/sample.yaml" --output evaluation
for launch in "$share"/launch/*.launch; do
  arguments=(bag:="$rounds/campus_cloudy_1.bag" map:="$work/round.map" output:="$work/again.map" folder:="$work")
  roslaunch --nodes "$launch" "${arguments[@]}" >/dev/null
done

# The node in a manager, fed by a recording; it also records what it verifies as a session.
roscore -p 11391 >roscore.log 2>&1 &
trap 'kill $(jobs -p) 2>/dev/null || true; wait || true' EXIT
wait_for roscore rosparam list
rosrun nodelet nodelet manager __name:=manager >manager.log 2>&1 &
roslaunch visual_localization localizer.launch map:="$work/round.map" image_transport:=compressed manager:=manager \
  session_folder:="$work" usage_file:="$work/usage.csv" >localizer.log 2>&1 &
wait_for localizer rosservice info /localizer/record_session
rosservice call /localizer/record_session "{record: true}"
rosbag play --quiet -d 2 -r 4 -u 60 "$rounds/campus_cloudy_1.bag" >/dev/null
rosservice call /localizer/record_session "{record: false, path: 'grown.map'}" | tee answer.txt
grep -q 'success: True' answer.txt
rosrun visual_localization map_info grown.map --check
echo "installed in $share: map, programs, launch files, nodelet and session work"
