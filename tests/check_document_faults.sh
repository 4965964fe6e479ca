#!/bin/bash
# check_document.sh takes a document that is right, and none that is wrong in one place.
#   check_document_faults.sh PROGRAM SOURCE_DIR
set -u
program=$1 source_dir=$2 here=$(dirname "$0")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat >"$work/right.md" <<'END'
`models/m/model.yaml`

```yaml
name: m
bodies:
```

`models/m/model.yaml`, continued

```yaml
  cart: {mass: 1, com: [0, 0, 0], inertia: [0.1, 0.1, 0.1]}
joints: {slide: {kind: prismatic, parent: world, child: cart, axis: x}}
drives: {push: {kind: joint, joint: slide}}
```

```console
$ mbverify check models/m/model.yaml
models/m/model.yaml: ok
$ mbverify model m
…
  degrees of freedom: 1 = 6 body coordinates - rank 5 of 5 joint constraints
…
$ mbverify check models/n/model.yaml >/dev/null 2>&1
$ echo $?
2
```
END
failed=0
expect() {  # WANTED_EXIT WHAT
  "$here/check_document.sh" "$work/document.md" "$program" >"$work/said" 2>&1
  local got=$?
  [ "$got" = "$1" ] || { echo "$2: exit code $got"; cat "$work/said"; failed=1; }
}
perturbed() {  # WHAT SED_SCRIPT
  sed "$2" "$work/right.md" >"$work/document.md"
  cmp -s "$work/right.md" "$work/document.md" && { echo "$1: nothing perturbed"; failed=1; }
  expect 1 "$1"
}
cp "$work/right.md" "$work/document.md"
expect 0 "the document that is right"
perturbed "another answer quoted" 's/^models.*: ok$/models\/m\/model.yaml: fine/'
perturbed "a piece of an answer quoted" 's/^  degrees of freedom: 1 = .*/  degrees of freedom: 1/'
perturbed "an answer that is not quoted" '/: ok$/d;/^\$ mbverify model/,/^…$/d'
perturbed "an answer longer than quoted" '/^  degrees of freedom/,/^…$/{/^…$/d}'
perturbed "another exit code quoted" 's/^2$/3/'
perturbed "an exit code that is not asked for" '/^\$ echo/,/^2$/d'
perturbed "a block without a file" 's/^`models.*continued$/and more/'
perturbed "a missing block" '/continued$/,/^```$/d'
perturbed "a block of another kind" 's/^```console$/```sh/'
# In the tree: blocks of commands, files by marks, and what is left out.
cat >"$work/right.md" <<'END'
<!-- file: note.txt -->
```text
two
```

```sh
mbverify list >list.txt    # what is shipped is there
grep -q four_bar/turn list.txt
grep -q two note.txt
```

```yaml
a: fragment
```

<!-- not run: it needs a key -->
```sh
exit 1
```
END
expect() {
  "$here/check_document.sh" "$work/document.md" "$program" --in-tree "$source_dir" >"$work/said" 2>&1
  local got=$?
  [ "$got" = "$1" ] || { echo "$2: exit code $got"; cat "$work/said"; failed=1; }
}
cp "$work/right.md" "$work/document.md"
expect 0 "the document of the tree that is right"
grep -q "1 blocks are not run" "$work/said" || { echo "what is not run is not counted"; failed=1; }
perturbed "a command that fails" 's/^grep -q two/grep -q three/'
perturbed "a failure before the last command" 's/four_bar\/turn/no_such_scenario/'
perturbed "a file without its mark" '/file: note/d'
perturbed "an unknown mark" 's/not run:/skipped:/'
perturbed "a mark without a reason" 's/not run: .* -->/not run: -->/'
perturbed "a mark that is not before its block" 's/^<!-- not run.*/&\nText between./'
perturbed "a block that does not end" '$d'
[ $failed = 0 ] && echo "every fault is found"
exit $failed
