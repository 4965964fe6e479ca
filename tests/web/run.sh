#!/bin/sh
# Makes a report page and looks at it in a browser: run.sh MBVERIFY SOURCE WORK NODE CHROMIUM
set -eu
mbverify=$1 source=$2 work=$3 node=$4 chromium=$5
cd "$source"
"$mbverify" run scenarios/stabilizing_platform/sea_state.yaml --quiet --out "$work/page" \
  --set 'snapshots.times_s=[1.42]' --set 'snapshots.size_px=[640, 480]'
MBV_PAGE=$work/page/stabilizing_platform/sea_state/report.html MBV_CHROMIUM=$chromium \
  NODE_PATH=$work/node_modules exec "$node" --test tests/web/report_page_test.cjs
