#!/usr/bin/env bash
# Builds one map of many bags on many cores or machines: map_builder for each bag, then map_edit merge as a tree.
# What is there already is not made again, so that a run that was cut short goes on where it was. Maps are written whole
# or not at all; logs lie beside them.
set -euo pipefail

readonly GROUP=8  # maps that one merge takes

usage() {
  cat <<'END'
Usage: build_large_map.sh --output MAP --work DIR [--runner parallel|slurm] [--jobs N] [--programs DIR]
                          [--builder-options TEXT] BAG...
  --output MAP           map to write
  --work DIR             folder for the maps in between; give it again to go on
  --runner parallel      GNU parallel on this machine (default)
  --runner slurm         a Slurm job array for each step; DIR and the bags must be seen by all nodes
  --jobs N               jobs at a time (default: one a core; Slurm: as many as it grants)
  --programs DIR         folder of map_builder and map_edit (default: those on the PATH)
  --builder-options TEXT options of map_builder, for instance '--camera-info camera.yaml --spacing 3'
A bag that fails is named, and the map is made of the others only with --allow-failures.
  --allow-failures       leave out bags that fail
END
}

die() {
  echo "build_large_map.sh: $*" >&2
  exit "${code:-1}"
}

# Runs the commands in a file, one a line; each writes its own log and may fail.
run_tasks() {
  local tasks=$1
  [[ -s $tasks ]] || return 0
  case $runner in
    parallel) parallel ${jobs:+--jobs "$jobs"} --halt never <"$tasks" || true ;;
    slurm)
      local count
      count=$(wc -l <"$tasks")
      sbatch --wait --quiet --job-name "$(basename "$tasks")" --output /dev/null \
        --array "1-$count${jobs:+%$jobs}" --wrap "sed -n \"\${SLURM_ARRAY_TASK_ID}p\" '$tasks' | bash" || true
      ;;
  esac
}

# One command: makes a map unless it is there, and keeps what it said.
task() {
  local map=$1
  shift
  [[ -s $map ]] || printf '%q ' "$@" --output "$map" | sed "s|\$|>$(printf '%q' "$map.log") 2>\&1|"
}

# Those maps of a step that were not made, each with the last line of its log.
report_missing() {
  local map missing=0
  for map in "$@"; do
    [[ -s $map ]] && continue
    echo "build_large_map.sh: failed: $map: $(tail -n 1 "$map.log" 2>/dev/null || echo 'no log')" >&2
    missing=$((missing + 1))
  done
  return $((missing > 0))
}

build_shards() {
  local bag map tasks=$work/build.tasks
  mkdir -p "$work/shards"
  : >"$tasks"
  for bag in "${bags[@]}"; do
    # Bags of one name may lie in several folders.
    map=$work/shards/$(basename "$bag" .bag)_$(realpath "$bag" | md5sum | cut -c 1-8).map
    # shellcheck disable=SC2086  # options are words
    { task "$map" "${programs}map_builder" --bag "$bag" --threads 1 $builder_options && echo; } >>"$tasks"
    shards+=("$map")
  done
  sed -i '/^$/d' "$tasks"
  echo "maps of bags: ${#shards[@]}, to be built: $(wc -l <"$tasks")"
  run_tasks "$tasks"
  if ! report_missing "${shards[@]}" && [[ $allow_failures == false ]]; then
    die "not merged: some bags failed; mend or leave them out, or give --allow-failures"
  fi
  local made=()
  for map in "${shards[@]}"; do [[ -s $map ]] && made+=("$map"); done
  shards=("${made[@]}")
  ((${#shards[@]} > 0)) || die "no map was built"
}

# Groups of maps become one each, until one is left.
merge_shards() {
  local level=1 merged tasks i
  while ((${#shards[@]} > 1)); do
    merged=() tasks=$work/merge_$level.tasks
    mkdir -p "$work/level_$level"
    : >"$tasks"
    for ((i = 0; i < ${#shards[@]}; i += GROUP)); do
      local group=("${shards[@]:i:GROUP}") map
      if ((${#group[@]} == 1)); then
        merged+=("${group[0]}")
        continue
      fi
      # Named after what is in it: other bags make another map.
      map=$work/level_$level/$(printf '%s\n' "${group[@]}" | md5sum | cut -c 1-16).map
      { task "$map" "${programs}map_edit" merge "${group[@]}" --threads 1 && echo; } >>"$tasks"
      merged+=("$map")
    done
    sed -i '/^$/d' "$tasks"
    echo "step $level: ${#shards[@]} maps become ${#merged[@]}"
    run_tasks "$tasks"
    report_missing "${merged[@]}" || die "not finished: a merge failed"
    shards=("${merged[@]}")
    level=$((level + 1))
  done
}

main() {
  local output='' work='' runner=parallel jobs='' programs='' builder_options='' allow_failures=false code bags=() shards=()
  while (($#)); do
    case $1 in
      --output) output=${2:?--output needs a file}; shift ;;
      --work) work=${2:?--work needs a folder}; shift ;;
      --runner) runner=${2:?--runner needs a name}; shift ;;
      --jobs) jobs=${2:?--jobs needs a number}; shift ;;
      --programs) programs=${2:?--programs needs a folder}/; shift ;;
      --builder-options) builder_options=${2?--builder-options needs a text}; shift ;;
      --allow-failures) allow_failures=true ;;
      -h | --help) usage; exit 0 ;;
      -*) usage >&2; exit 2 ;;
      *) bags+=("$1") ;;
    esac
    shift
  done
  if [[ -z $output || -z $work || ${#bags[@]} -eq 0 ]]; then usage >&2; exit 2; fi
  [[ $runner == parallel || $runner == slurm ]] || code=2 die "--runner $runner: must be parallel or slurm"
  [[ -z $jobs || $jobs =~ ^[1-9][0-9]*$ ]] || code=2 die "--jobs $jobs: must be a number above 0"
  local tool=parallel
  [[ $runner == slurm ]] && tool=sbatch
  command -v "$tool" >/dev/null || die "$tool is not installed"
  mkdir -p "$work"
  work=$(cd "$work" && pwd)
  build_shards
  local built=${#shards[@]}
  merge_shards
  cp "${shards[0]}" "$output.copy.partial"
  mv "$output.copy.partial" "$output"
  echo "$output: of $built of ${#bags[@]} bags"
}

main "$@"
