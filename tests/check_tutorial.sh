#!/bin/bash
# docs/tutorial.md builds exactly the shipped files, and the program says what it quotes.
#   check_tutorial.sh SOURCE_DIR PROGRAM
# A block below `<!-- FILE -->` is a piece of FILE; pieces follow one another (blank lines apart). Of
# a ```console block, the first line is run and each further one must occur in what it prints.
set -u
source_dir=$1 program=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$source_dir" || exit 2

awk -v work="$work" '
  /^<!-- [a-z_\/]+\.yaml -->$/ { file = $2; next }
  /^```yaml$/ && file != "" { out = work "/" file; dir = out; sub(/\/[^\/]*$/, "", dir)
                              system("mkdir -p " dir); inside = 1; next }
  /^```console$/ { ++n; out = work "/console." n; inside = 1; next }
  /^```$/ { if (inside) { close(out) } inside = 0; file = ""; next }
  inside { print >> out }
' docs/tutorial.md

failed=0 files=0
fail() { echo "$1"; failed=1; }
for file in $(cd "$work" && find models scenarios -name '*.yaml' | sort); do
  files=$((files + 1))
  diff -B "$work/$file" "$file" || fail "docs/tutorial.md and $file differ"
done
[ "$files" -ge 11 ] || fail "only $files files found in docs/tutorial.md"

consoles=0
for block in "$work"/console.*; do
  consoles=$((consoles + 1))
  command=$(sed -n '1s/^\$ mbverify //p' "$block")
  [ -n "$command" ] || { fail "$block: the first line is no command"; continue; }
  case $command in run*) command="$command --no-pictures --out $work/out" ;; esac
  # shellcheck disable=SC2086
  NO_COLOR= "$program" $command >"$work/printed" 2>&1
  while IFS= read -r line; do
    grep -qF -- "$line" "$work/printed" || fail "mbverify $command does not print: $line"
  done < <(sed 1d "$block")
done
[ "$consoles" -ge 6 ] || fail "only $consoles commands found in docs/tutorial.md"

# The values found by hand.
holds() {  # SCENARIO CHANNEL VALUE, of the last run
  awk -F, -v channel="$2" -v value="$3" '
    NR == 1 { for (i = 1; i <= NF; ++i) if ($i == channel) column = i }
    NR == 2 { found = column > 0 && ($column - value)^2 <= (1e-9)^2 }
    END { exit !found }' "$work/out/$1/traces.csv" || fail "$1: $2 is not $3"
}
run() { "$program" run -q "scenarios/$1.yaml" --no-pictures --out "$work/out" "${@:2}" >/dev/null 2>&1; }
expect() {  # SCENARIO CHANNEL VALUE
  run "$1" || fail "$1 does not agree"
  holds "$@"
}
for witness in reference simulated; do
  expect four_bar/static "motor.force.$witness" 0.5886
  expect slider_crank/static "motor.force.$witness" -1.4090500577288894
  expect stewart/static "leg4.length.force.$witness" 37.3393125
done
# In its dead centres the torque vanishes; the witnesses still agree.
expect_at() {  # SCENARIO CHANNEL VALUE ARGUMENTS…
  run "$1" "${@:4}" || fail "$1 ${*:4} does not agree"
  holds "$1" "$2" "$3"
}
expect_at slider_crank/static slider.z.reference 0.60 --set motion.commands.motor=0
expect_at slider_crank/static slider.z.reference 0.52 --set motion.commands.motor=pi
# Closed inverse kinematics of a leg: |p + R b − a|.
expect stewart/static leg1.length.position.reference 0.5

[ $failed = 0 ] && echo "$files files, $consoles commands and all values by hand are right"
exit $failed
