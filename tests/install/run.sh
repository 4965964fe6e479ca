#!/bin/sh
# Installs the build, builds the example of a closed form against it, and runs that:
# run.sh CMAKE BUILD SOURCE WORK
set -eu
cmake=$1 build=$2 source=$3 work=$4
rm -rf "$work"
mkdir -p "$work"
"$cmake" --install "$build" --prefix "$work/prefix" >"$work/install.log"
# The program alone finds its models and scenarios; nothing of the source tree is left in them.
cd "$work"
prefix/bin/mbverify list | grep -q spr_tripod/static
prefix/bin/mbverify run prefix/share/mbverify/scenarios/spr_tripod/static.yaml --quiet --no-pictures
grep -q "_mbverify mbverify" prefix/share/bash-completion/completions/mbverify
grep -q "^#compdef mbverify" prefix/share/zsh/vendor-completions/_mbverify
grep -q "complete -c mbverify" prefix/share/fish/vendor_completions.d/mbverify.fish
# Schemas of JSON, one of each document.
grep -q '"mbverify.run/1"' prefix/share/mbverify/schemas/run.schema.json
# The example, copied away from the source tree.
cp -r "$source/examples/closed_form" example
"$cmake" -S example -B example/build -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" >configure.log
"$cmake" --build example/build >build.log 2>&1 || { cat build.log >&2; exit 1; }
cd example
build/my_mbverify run turn.yaml --no-pictures | tee ../run.log
grep -q 'AGREE' ../run.log
grep -q 'analytic' out/planar_slider_crank/turn/summary.json
# A wrong number in the closed form alone turns the verdict; so does a motion it cannot take.
if build/my_mbverify run turn.yaml --quiet --no-pictures \
  --set 'analytic.parameters={m_rod: 1.201}'; then exit 1; else [ $? = 1 ]; fi
if build/my_mbverify run turn.yaml --quiet --no-pictures \
  --set 'motion.commands={slider.x: 0.4}' 2>../refused.log; then exit 1; else [ $? = 2 ]; fi
grep -q 'takes the command' ../refused.log
# The regression's workers are this program too.
build/my_mbverify regress turn.yaml --no-pictures --no-history --quiet --out ../regression
# A program that calls the solver object: its legs carry the platform and lift it.
cp -r "$source/examples/solver" "$work/solver"
cd "$work/solver"
"$cmake" -S . -B build -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" >configure.log
"$cmake" --build build >build.log 2>&1 || { cat build.log >&2; exit 1; }
MBVERIFY_MODELS="$work/prefix/share/mbverify/models" build/lift >forces.txt
awk 'NF != 6 { exit 1 } { for (i = 1; i <= 6; ++i) if (!($i > 0)) exit 1 }' forces.txt
