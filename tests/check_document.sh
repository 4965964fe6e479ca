#!/bin/bash
# Does what a document says, in a folder of its own and in its order, and compares what the program
# answers with what the document quotes.
#   check_document.sh DOCUMENT PROGRAM [SOURCE_DIR]             in an empty folder
#   check_document.sh DOCUMENT PROGRAM --in-tree SOURCE_DIR     as in the built source tree
# A ```yaml or ```xml block below a line `FILE` (or `FILE`, continued) is a piece of FILE; so is any
# block below <!-- file: FILE -->. Of a ```console block, lines with $ are run and what follows must
# be what they print; "…" stands for lines left out. A command fails the test with its exit code
# unless `echo $?` asks for it. A ```sh block is run as a whole and must end with 0. Below
# <!-- not run: REASON --> a block is left out. In the tree other blocks are fragments to read; in an
# empty folder each has a file. With SOURCE_DIR alone, the files must be those that are shipped, and
# the values found by hand must be in the results.
set -u
document=$(realpath "$1") program=$(realpath "$2") tree=
if [ "${3:-}" = --in-tree ]; then tree=$(realpath "$4") source_dir=; else source_dir=${3:+$(realpath "$3")}; fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/bin" "$work/blocks" "$work/here" "$work/home"
if [ -n "$tree" ]; then
  ln -s "$tree/models" "$tree/scenarios" "$tree/docs" "$tree/scripts" "$work/here"
  cp -r "$tree/examples" "$work/here"
  mkdir "$work/here/build" && ln -s "$(dirname "$program")" "$work/here/build/release"
  ln -s "$program" "$work/bin/mbverify"
  [ -x /usr/bin/python3 ] && ln -s /usr/bin/python3 "$work/bin"  # which has Debian's NumPy
  export HOME="$work/home"
else
  # Away from the shipped models: what the document does not write is not there.
  cp "$program" "$work/bin/mbverify"
fi
unset MBVERIFY_MODELS COLUMNS
export PATH="$work/bin:$PATH" NO_COLOR=1
cd "$work/here" || exit 2

failed=0
fail() { echo "$1"; failed=1; }

# blocks/NNN.FILE_WITH_%_FOR_/.yaml, blocks/NNN.console and NNN.sh; NNN.left_out; NNN.wrong says why.
awk -v blocks="$work/blocks" -v in_tree="$tree" '
  function open_block(kind) { gsub("/", "%", kind); out = sprintf("%s/%03d.%s", blocks, ++n, kind); printf "" > out }
  function wrong(what) { open_block("wrong"); print what > out; close(out); out = "" }
  inside && /^```$/ { if (out != "") close(out); inside = 0; file = reason = ""; next }
  inside { if (out != "") print >> out; next }
  /^`[a-z_\/]+\.(yaml|urdf|xml)`(, continued)?$/ { file = $0; gsub(/`|, continued/, "", file); next }
  /^<!--.*-->$/ { mark = $0; sub(/^<!-- */, "", mark); sub(/ *-->$/, "", mark)
                  if (mark ~ /^not run: *[^ ]/) reason = mark
                  else if (mark ~ /^file: *[^ ]+$/) { file = mark; sub(/^file: */, "", file) }
                  else if (mark ~ /^(accuracy|step study): /) next  # tables that programs and tests look for
                  else wrong("a mark that is none: " $0)
                  next }
  /^```/ { inside = 1; out = ""
           if (reason != "") open_block("left_out")
           else if ($0 == "```console") open_block("console")
           else if ($0 == "```sh" && (in_tree != "" || file != "")) open_block(file == "" ? "sh" : file)
           else if (file != "") open_block(file)
           else if ($0 == "```text" || in_tree != "" || $0 == "```xml") next
           else if ($0 == "```yaml") open_block("none.yaml")
           else open_block("unknown")
           next }
  /[^ ]/ { file = reason = "" }
  END { if (inside) wrong("a block that does not end") }
' "$document"

# The lines of $expected are those of $printed, where … is any number of lines.
same_lines() {
  local expected=$1 printed=$2
  awk -v expected="$expected" '
    { printed[++m] = $0 }
    END {
      while ((getline line < expected) > 0) want[++n] = line
      if (n == 0) exit 0
      k = 1
      for (i = 1; i <= n; ++i) {
        if (want[i] == "…") { skip = 1; continue }
        while (skip && k <= m && printed[k] != want[i]) ++k
        if (k > m || printed[k] != want[i]) { print "  quoted:  " want[i]; print "  printed: " printed[k]; exit 1 }
        ++k
        skip = 0
      }
      if (!skip && k <= m) { print "  not quoted: " printed[k]; exit 1 }
    }' "$printed"
}

commands=0 left_out=0 status=0 command=
finish() {  # of the command before, now that its quoted answer is known
  [ -n "$command" ] || return
  same_lines "$work/expected" "$work/printed" || fail "\$ $command: the document quotes something else"
}
begin() {
  if [ "$status" -ne 0 ] && [ "$1" != 'echo $?' ]; then
    fail "\$ $command: exit code $status"; cat "$work/printed"
  fi
  command=$1
  commands=$((commands + 1))
  bash -c "(exit $status); $command" >"$work/printed" 2>&1 </dev/null
  status=$?
  : >"$work/expected"
}
for block in "$work"/blocks/*; do
  kind=${block##*/} kind=${kind#*.}
  case $kind in
    wrong) fail "$(cat "$block")" ;;
    left_out) left_out=$((left_out + 1)) ;;
    sh)
      commands=$((commands + $(grep -c . "$block")))
      bash -euo pipefail "$block" >"$work/printed" 2>&1 </dev/null ||
        { fail "\`\`\`sh: exit code $? of: $(cat "$block")"; tail -20 "$work/printed"; } ;;
    unknown|none.yaml) fail "a block that is neither file nor commands: $(head -1 "$block")" ;;
    console)
      while IFS= read -r line || [ -n "$line" ]; do
        case $line in
          '$ '*) finish; begin "${line#\$ }" ;;
          *) echo "$line" >>"$work/expected" ;;
        esac
      done <"$block"
      finish
      begin :
      commands=$((commands - 1)) command= ;;
    *)
      file=${kind//%//}
      mkdir -p "$(dirname "$file")"
      [ -e "$file" ] && echo >>"$file"
      cat "$block" >>"$file" ;;
  esac
done
files=$(find . -name '*.yaml' -not -path './out/*' | wc -l)

if [ -n "$source_dir" ]; then
  [ "$files" -ge 14 ] || fail "only $files files found in $document"
  [ "$commands" -ge 20 ] || fail "only $commands commands found in $document"
  for file in $(find models scenarios -name '*.yaml' | sort); do
    diff -B "$file" "$source_dir/$file" || fail "$document and $file differ"
  done
  holds() {  # SCENARIO CHANNEL VALUE, of the last run
    awk -F, -v channel="$2" -v value="$3" '
      NR == 1 { for (i = 1; i <= NF; ++i) if ($i == channel) column = i }
      NR == 2 { found = column > 0 && ($column - value)^2 <= (1e-9)^2 }
      END { exit !found }' "out/$1/traces.csv" || fail "$1: $2 is not $3"
  }
  expect() {  # SCENARIO CHANNEL VALUE ARGUMENTS…
    mbverify run -q "scenarios/$1.yaml" --no-pictures --no-report "${@:4}" >/dev/null 2>&1 ||
      fail "$1 ${*:4} does not agree"
    holds "$1" "$2" "$3"
  }
  for witness in reference simulated; do
    expect four_bar/static "motor.force.$witness" 0.5886
    expect slider_crank/static "motor.force.$witness" -1.4090500577288894
    expect stewart/static "leg4.length.force.$witness" 37.3393125
  done
  # In its dead centres the torque vanishes; the witnesses still agree.
  expect slider_crank/static slider.z.reference 0.60 --set motion.commands.motor=0
  expect slider_crank/static slider.z.reference 0.52 --set motion.commands.motor=pi
  # Closed inverse kinematics of a leg: |p + R b − a|.
  expect stewart/static leg1.length.position.reference 0.5
fi

[ $failed = 0 ] && echo "$files files and $commands commands do what the document says, $left_out blocks are not run"
exit $failed
