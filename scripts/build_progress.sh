# shellcheck shell=bash
# What the scripts that install or build share: headings, progress, errors. To be sourced; the caller sets -o pipefail.

step() { printf '\n== %s\n' "$*"; }

fail() {
  echo "$(basename "$0" .sh): $*" >&2
  exit 1
}

# read_percent LINE: sets `percent` to what a line of make, ctest or show_progress says, or of apt-get with
# APT::Status-Fd, of which one half is the download. Parallel jobs end out of order: a small step back is left out.
read_percent() {
  local line=$1 found=$percent
  if [[ $line =~ ^\[\ *([0-9]+)%\] || $line =~ ^\ \ [a-z\ ]+\ ([0-9]+)\ %\  ]]; then
    found=${BASH_REMATCH[1]}
  elif [[ $line =~ ^\ *([0-9]+)/([0-9]+)\ Test ]]; then
    found=$((100 * BASH_REMATCH[1] / BASH_REMATCH[2]))
  elif [[ $line =~ ^dlstatus:[^:]*:([0-9]+) ]]; then
    found=$((BASH_REMATCH[1] / 2))
  elif [[ $line =~ ^pmstatus:[^:]*:([0-9]+) ]]; then
    found=$((50 + BASH_REMATCH[1] / 2))
  fi
  if ((found > percent || found < percent - 10)); then percent=$found; fi
}

# Whether what show_progress showed last is out of date.
is_due() {
  if [[ -t 1 ]]; then
    ((percent != shown || SECONDS > shown_at))
  else
    ((shown < 0 || percent / 10 != shown / 10 || SECONDS - shown_at >= 30))
  fi
}

# show_progress WHAT LOG: adds its input to LOG and shows how far it is: on a terminal one line that is renewed every
# second, elsewhere a line at each tenth percent and after 30 s without one.
show_progress() {
  local what=$1 log=$2 begin=$SECONDS percent=0 shown=-1 shown_at=0 line='' part status=0 end='\n' out
  if [[ -t 1 ]]; then end='\r'; fi
  exec {out}>>"$log"
  while ((status == 0 || status > 128)); do  # above 128: the line is not complete yet
    status=0
    IFS= read -r -t 1 part || status=$?
    line+=$part
    if ((status <= 128)) && [[ -n $line || $status -eq 0 ]]; then
      read_percent "$line"
      if [[ $line != [dp][lm]status:* ]]; then printf '%s\n' "$line" >&"$out"; fi
      line=''
    fi
    if is_due; then
      shown=$percent shown_at=$SECONDS
      printf "  %s %3d %%  %d:%02d$end" "$what" "$percent" $(((SECONDS - begin) / 60)) $(((SECONDS - begin) % 60))
    fi
  done
  if [[ -t 1 ]]; then echo; fi
  exec {out}>&-
}

# with_progress WHAT LOG COMMAND...: runs the command; its output goes to LOG, its progress to the screen. Has the
# command's exit code.
with_progress() {
  local what=$1 log=$2
  shift 2
  "$@" 2>&1 | show_progress "$what" "$log"
}

# The first errors in the log of a build.
show_errors() {
  grep -E -m 5 -A 5 'error: |undefined reference|^CMake Error|\*\*\* ' "$1" >&2 || tail -n 20 "$1" >&2
}
