#!/bin/sh
# Makes pages and looks at them in a browser: run.sh MBVERIFY SOURCE WORK NODE CHROMIUM report|mesh|regression|gate|axe
set -eu
mbverify=$1 source=$2 work=$3 node=$4 chromium=$5 what=$6
cd "$source"
export MBV_CHROMIUM="$chromium" NODE_PATH="$work/node_modules"
case $what in
report)
  "$mbverify" run scenarios/stabilizing_platform/sea_state.yaml --quiet --out "$work/page" \
    --set 'snapshots.times_s=[1.42]' --set 'snapshots.size_px=[640, 480]'
  MBV_PAGE=$work/page/stabilizing_platform/sea_state/report.html \
    exec "$node" --test tests/web/report_page_test.cjs
  ;;
mesh)
  # A robot whose arm is a box of 100 × 200 × 300 mm, from a file.
  rm -rf "$work/mesh" && mkdir -p "$work/mesh"
  cat >"$work/mesh/box.obj" <<'EOF'
v 0 0 0
v 100 0 0
v 100 200 0
v 0 200 0
v 0 0 300
v 100 0 300
v 100 200 300
v 0 200 300
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
EOF
  cat >"$work/mesh/robot.urdf" <<'EOF'
<robot name="box_arm"><link name="world"/><link name="arm"><inertial><origin xyz="0.05 0.1 0.25"/>
<mass value="6"/><inertia ixx="0.065" iyy="0.05" izz="0.025" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0 0 0.1"/><geometry><mesh filename="box.obj" scale="0.001 0.001 0.001"/></geometry>
<material name="red"><color rgba="0.9 0 0 1"/></material></visual></link>
<joint name="hinge" type="continuous"><parent link="world"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>
EOF
  "$mbverify" run "$work/mesh/robot.urdf" --quiet --no-pictures --out "$work/mesh/out" >/dev/null
  MBV_PAGE=$work/mesh/out/box_arm/setup/first/report.html \
    exec "$node" --test tests/web/mesh_page_test.cjs
  ;;
gate)
  # Errors far below round-off, a table, a motion at rest, one that fails, forces given, and a
  # stiffness, whose page has no script.
  rm -rf "$work/gate"
  for scenario in four_bar/static four_bar/table_matlab slider_crank/press stewart/wave \
    spring_cart/swing spr_tripod/must_fail/simulated_com scara_robot/stiffness; do
    "$mbverify" run "scenarios/$scenario.yaml" --quiet --no-pictures --out "$work/gate" >/dev/null ||
      [ $? = 1 ]
  done
  exec "$node" tests/web/page_gate.cjs "$work/gate"
  ;;
axe)
  # A motion with pictures, a failure, a table, a stiffness, one that could not run, and a regression run.
  rm -rf "$work/axe"
  "$mbverify" regress --quiet --no-history --out "$work/axe" --jobs 2 \
    scenarios/four_bar/table_matlab.yaml scenarios/spr_tripod/static.yaml \
    scenarios/spr_tripod/must_fail/simulated_com.yaml scenarios/scara_robot/stiffness.yaml \
    scenarios/spr_tripod/must_fail/below_base.yaml scenarios/four_bar/must_fail/wrong_mass.yaml
  exec "$node" tests/web/axe_gate.cjs "$work/axe"
  ;;
regression)
  # Agree, disagree, could not run, bad input, one that is not what its file says, and one whose
  # limit becomes too tight after the first of two runs; another is gone then.
  rm -rf "$work/regression" "$work/own"
  mkdir -p "$work/own/scenarios/own"
  own=$work/own/scenarios/own
  sed -e "s|^mechanism:.*|mechanism: $source/models/scara_robot/model.yaml|" -e '/^expect:/d' \
    scenarios/scara_robot/static.yaml >"$own/wrong_expectation.yaml"
  echo 'expect: {verdict: disagree, exit_code: 1}' >>"$own/wrong_expectation.yaml"
  for copy in tight gone; do
    sed -e "s|^mechanism:.*|mechanism: $source/models/spr_tripod/model.yaml|" \
      scenarios/spr_tripod/static.yaml >"$own/$copy.yaml"
  done
  for run in 1 2; do
    "$mbverify" regress --quiet --no-pictures --out "$work/regression" scenarios/spr_tripod/static.yaml \
      scenarios/spr_tripod/must_fail/simulated_com.yaml scenarios/spr_tripod/literal.yaml \
      scenarios/stabilizing_platform/must_fail/no_yaml.yaml "$own" \
      >/dev/null && exit 1 || [ $? = 1 ]
    [ $run = 2 ] && break
    rm "$own/gone.yaml"
    sed -i 's/inverse: 1.0e-11/inverse: 1.0e-25/' "$own/tight.yaml"
  done
  MBV_REGRESSION=$work/regression "$node" --test tests/web/index_page_test.cjs
  # The page of a red run, with all its boxes.
  mkdir -p "$work/red_run" && cp "$work/regression/index.html" "$work/red_run"
  exec "$node" tests/web/axe_gate.cjs "$work/red_run"
  ;;
esac
