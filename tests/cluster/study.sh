# What the tests of examples/cluster share; sourced with the program and the project's folder as
# arguments. Each computes one study at once and in six shards: the bytes must be the same.
mbverify=$(realpath "$1") source_dir=$(realpath "$2")
cluster=$source_dir/examples/cluster
shards=6
name=sea_state_tolerances
export PATH="$(dirname "$mbverify"):$PATH" NO_COLOR=1
unset MBVERIFY_MODELS

# Exit code 77 is a skip to ctest; where everything has to be there, as in CI, it is a failure.
skip() {
  echo "skipped: $1"
  [ -z "${MBV_NO_SKIP:-}" ] || { echo "MBV_NO_SKIP is set: this must run here"; exit 1; }
  exit 77
}
need() {  # PROGRAM…
  local program
  for program; do
    command -v "$program" >/dev/null || skip "$program is not installed"
  done
}
fail() { echo "failed: $1"; exit 1; }

# A shipped study of 40 s of the motion, with eight points in each shard: about 1 s. A blank in the
# name belongs to it.
make_study() {
  local shipped=$source_dir/scenarios/stabilizing_platform
  sed 's|^  duration_s: .*|  duration_s: 40|; s|^snapshots:|snapshots: {}|; /times_s:/d' \
    "$shipped/sea_state.yaml" >sea_state.yaml
  sed 's|^design: .*|design: {latin_hypercube: 48}|' "$shipped/study_tolerances.yaml" >'my study.yaml'
  grep -q 48 'my study.yaml' || fail "the shipped study has another design"
  mbverify study 'my study.yaml' --out once --jobs 2 >once.txt || fail "the study at once: $?"
}
same_as_at_once() {  # FOLDER
  local file
  for file in points.csv forces.bin summary.json report.html study.json; do
    cmp "once/$name/$file" "$1/$name/$file" || fail "$1: $file is not that of the study at once"
  done
}

# Another digit at the end of a finished shard.
alter() {  # OUT SHARD
  local rows=$1/shards/$name.shard-$2-of-$shards/points.csv
  cp "$rows" before.csv
  sed -i '${s/9$/8/; t; s/.$/9/}' "$rows"
  ! cmp -s before.csv "$rows" || fail "nothing was altered"
}

# Ends all that works in a folder when a process has ended, killed or not, and removes the folder.
# Twice away from that process, so that who kills it with its children does not find this one.
watch_over() {  # PROCESS FOLDER
  (cd / && setsid bash -c '
    while kill -0 "$1" 2>/dev/null; do sleep 0.2; done
    for round in 1 2 3; do
      for process in /proc/[0-9]*; do
        case $(readlink "$process/cwd") in "$2"/*) kill -KILL "${process#/proc/}" ;; esac
      done
      sleep 0.2
    done
    rm -rf "$2"' watch_over "$1" "$2" </dev/null >/dev/null 2>&1 &)
}

# Waits for a condition, at most this many seconds.
wait_for() {  # SECONDS WHAT COMMAND…
  local end=$((SECONDS + $1)) what=$2
  shift 2
  until "$@"; do
    [ $SECONDS -lt $end ] || fail "waited in vain until $what"
    sleep 0.05
  done
}

# The rows of a shard that is being computed, and of one that may be finished.
rows_of() {  # OUT SHARD
  local folder=$1/shards/$name.shard-$2-of-$shards
  cat "$folder.part/points.csv" 2>/dev/null || cat "$folder/points.csv" 2>/dev/null
}
computes() {  # OUT SHARD: some rows are there, others are not
  local rows
  [ -e "$1/shards/$name.shard-$2-of-$shards.part/points.csv" ] || return
  rows=$(($(rows_of "$1" "$2" | wc -l) - 1))
  [ "$rows" -ge 2 ] && [ "$rows" -lt 8 ]
}
# Holds a shard that has some of its rows.
hold() {  # OUT SHARD
  wait_for 60 "shard $2 has rows" computes "$1" "$2"
  kill -STOP "$(process_of "$2")" && computes "$1" "$2" || fail "shard $2 was finished too early"
}
# The process that computes a shard, not its workers nor who started it.
process_of() {  # SHARD
  local process
  for process in $(pgrep -f -x "[^ ]*mbverify study my study.yaml --shard $1/$shards .*"); do
    [ "/proc/$process/cwd" -ef . ] && echo "$process" && return
  done
}

# Watches that no row of a shard goes any more: who begins anew cuts them all.
watch_rows() {  # OUT SHARD
  local kept now
  kept=$(rows_of "$1" "$2" | wc -l)
  until [ -e "$1/shards/$name.shard-$2-of-$shards" ]; do
    now=$(rows_of "$1" "$2" | wc -l)
    [ "$now" -ge "$kept" ] || { echo "shard $2 had $kept lines and has $now" >"begun_anew.$2"; return; }
    kept=$now
    sleep 0.02
  done
}
