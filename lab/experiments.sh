#!/usr/bin/env bash
# Makes the committed reports of doc/experiments again.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly repo
# Times depend on the machine, everything else on configuration, recordings and version alone.
readonly TIMES='_ms$|^ms_per_image$'
readonly OF_PAPERS='comparison comparison_turned particles speed single_run kidnapped motion_grid hybrid hybrid_particles
thresholds pruning'
readonly OF_PACKAGE='real real_swarm metric_pairs comparison_package'

usage() {
  cat <<'USAGE'
Usage: experiments.sh [--check] [--only NAME] [--programs DIR] [OUTPUT]
  OUTPUT          folder of the reports (default: build/experiments); results that are there already are not repeated
  --only NAME     this experiment alone
  --check         the sample alone: compares its tables with those of doc/experiments, all but the times
  --programs DIR  where evaluate is (default: that of the build that scripts/test.sh makes)
The sample needs nothing beside the repository. The others read the recordings in the folder VISUAL_LOCALIZATION_DATA
(config/evaluation/NAME.yaml names them) and are left out without it. They take hours.
USAGE
}

fail() {
  echo "experiments.sh: $1" >&2
  exit 1
}

# The report PRESET/NAME; "package": by the package's defaults.
evaluate() {
  local preset=$1 name=$2 folder=$output/$1/$2 arguments=()
  if [[ -n $only && $only != "$name" ]]; then return; fi
  if [[ $preset != package ]]; then arguments+=(--preset "$preset"); fi
  if [[ $name != sample ]]; then arguments+=(--rounds "$rounds"); fi
  mkdir -p "$folder"
  "$programs/evaluate" --config "$repo/config/evaluation/$name.yaml" --output "$folder" "${arguments[@]}"
}

# The same route, turned by 30 degrees.
turn_rounds() {
  local name
  for name in sunny_1 sunny_2 sunny_3 cloudy_1 cloudy_2 cloudy_3; do
    [[ -e $rounds/turned_$name.bag ]] || "$repo/lab/turn_round.py" "$rounds/campus_a_$name.bag" \
      "$rounds/turned_$name.bag" --degrees 30 --about 48.53450 9.07130
  done
}

check() {
  local preset table
  for preset in paper paper_program package; do
    for table in summary pairs steps; do
      /usr/bin/python3 - "$repo/doc/experiments/$preset/sample/$table.csv" "$output/$preset/sample/$table.csv" "$TIMES" <<'PYTHON'
import csv, re, sys
kept, made, times = sys.argv[1:]
def rows(path):
    with open(path, newline='', encoding='utf-8') as file:
        return [{key: value for key, value in row.items() if not re.search(times, key)} for row in csv.DictReader(file)]
if rows(kept) != rows(made):
    sys.exit(f'experiments.sh: {made} differs from {kept}')
print(f'{kept}: the same, all but the times')
PYTHON
    done
  done
}

main() {
  local output=$repo/build/experiments only='' checks=false programs=$repo/build/test/devel/lib/visual_localization
  while (($#)); do
    case $1 in
      --check) checks=true only=sample ;;
      --only) only=${2:?--only needs a name}; shift ;;
      --programs) programs=${2:?--programs needs a folder}; shift ;;
      -h | --help) usage; exit 0 ;;
      -*) usage >&2; exit 2 ;;
      *) output=$1 ;;
    esac
    shift
  done
  [[ -x $programs/evaluate ]] || fail "$programs has no program evaluate: run scripts/test.sh, or name its folder"
  local name preset
  for preset in paper paper_program package; do evaluate "$preset" sample; done
  if [[ $checks == true ]]; then check; return; fi
  if [[ -z ${VISUAL_LOCALIZATION_DATA:-} ]]; then
    echo "experiments.sh: VISUAL_LOCALIZATION_DATA names no folder of recordings: only the sample"
    return
  fi
  local rounds=$output/rounds
  mkdir -p "$rounds"
  ln -sfn "$VISUAL_LOCALIZATION_DATA"/* "$rounds/"
  turn_rounds
  for name in $OF_PAPERS; do
    for preset in paper paper_program; do evaluate "$preset" "$name"; done
  done
  evaluate paper ledger
  for name in $OF_PACKAGE; do evaluate package "$name"; done
  "$repo/lab/report_claims.py" "$output"
}

main "$@"
