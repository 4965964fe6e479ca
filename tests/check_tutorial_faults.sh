#!/bin/bash
# check_tutorial.sh takes a document that is right, and none that is wrong in one place.
#   check_tutorial_faults.sh PROGRAM
set -u
program=$1 here=$(dirname "$0")
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
  "$here/check_tutorial.sh" "$work/document.md" "$program" >"$work/said" 2>&1
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
perturbed "an exit code that nobody asks for" '/^\$ echo/,/^2$/d'
perturbed "a block without a file" 's/^`models.*continued$/and more/'
perturbed "a missing block" '/continued$/,/^```$/d'
perturbed "a block of another kind" 's/^```console$/```sh/'
[ $failed = 0 ] && echo "every fault is found"
exit $failed
