#!/usr/bin/env bash
# Rejects includes that the layer table of docs/architecture.md forbids.
# Usage: check_layers.sh ROOT [LISTING]; a listing of "path:include" lines replaces the search
# (used by the self-test below).
set -u
root=$1

# folder: our folders it may include
declare -A ours=(
  [core]="core"
  [mechanism]="core mechanism"
  [scenario]="core mechanism scenario"
  [analytic]="core mechanism analytic"
  [reference]="core mechanism reference"
  [audit]="core mechanism analytic reference audit"
  [mjcf]="core mechanism mjcf"
  [simulation]="core mechanism scenario mjcf simulation"
  [render]="core mechanism mjcf simulation render"
  [comparison]="core mechanism scenario comparison"
  [report]="core mechanism comparison report"
  [pipeline]="core mechanism scenario analytic reference audit mjcf simulation render comparison report pipeline"
  [regress]="core mechanism scenario regress"
  [cli]="core mechanism scenario analytic audit comparison report pipeline regress cli"
)
# external header prefix: folders that may include it
declare -A external=(
  [mujoco/]="simulation render"
  [GL/]="render"
  [png]="render regress"
  [urdf]="mechanism"
  [muParser]="mechanism"
  [yaml-cpp/]="mechanism scenario"
  [tinyxml2]="mjcf mechanism"
  [CLI/]="cli"
  [nlohmann/]="report regress cli"
  [sqlite3]="regress"
  [zlib]="regress"
  [boost/]="reference comparison"
)

check() {  # reads "src/folder/file:header" lines, prints offences
  local line path header folder target prefix
  while IFS= read -r line; do
    path=${line%%:*} header=${line#*:}
    folder=${path#src/} folder=${folder%%/*}
    [ -n "${ours[$folder]+x}" ] || { echo "$path: folder '$folder' is not in the layer table"; continue; }
    target=${header%%/*}
    if [ "$target" != "$header" ] && [ -n "${ours[$target]+x}" ]; then
      [[ " ${ours[$folder]} " == *" $target "* ]] || echo "$path: $folder may not include $header"
    fi
    for prefix in "${!external[@]}"; do
      if [[ "$header" == "$prefix"* ]]; then
        [[ " ${external[$prefix]} " == *" $folder "* ]] || echo "$path: $folder may not include $header"
      fi
    done
  done
}

# The check itself must be able to fail.
bad=$'src/analytic/a.cc:simulation/simulation.h\nsrc/reference/r.cc:mujoco/mujoco.h\nsrc/comparison/c.cc:analytic/x.h'
if [ "$(printf '%s\n' "$bad" | check | wc -l)" != 3 ]; then
  echo "check_layers: the self-test did not find its three offences"
  exit 1
fi

offences=$(cd "$root" && grep -rnoE '^[[:space:]]*#include [<"][^>"]+' src --include='*.h' --include='*.cc' \
  | grep -v '^src/main.cc' | sed -E 's/^([^:]+):[0-9]+:[[:space:]]*#include [<"]/\1:/' | check)
if [ -n "$offences" ]; then
  echo "$offences"
  exit 1
fi
echo "all includes follow the layer table"
