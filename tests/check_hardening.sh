#!/bin/sh
# The built program has the protections of CMakePresets.json, no path of the machine that built it,
# and no OpenGL to load at its start: check_hardening.sh PROGRAM SOURCE_DIR [RELEASE]. Exit code 1
# with a line per lack.
program=$1 folder=$2 release=${3:-1}
lacks=0
lack() {
  echo "$program: $1"
  lacks=$((lacks + 1))
}
has() { grep -qE "$1"; }
readelf -dW "$program" | has 'BIND_NOW|FLAGS_1.* NOW' || lack 'symbols are bound late (no BIND_NOW)'
readelf -lW "$program" | has GNU_RELRO || lack 'no GNU_RELRO'
readelf -hW "$program" | has 'Type: *DYN' || lack 'no position-independent executable'
! readelf -dW "$program" | has 'NEEDED.*libOSMesa' || lack 'it loads OSMesa before the first picture'
! readelf -dW "$program" | has '(RPATH|RUNPATH).*(\[:|::|:\]|\[\])' || lack 'it looks for libraries where it is called'
symbols=$(readelf --dyn-syms -W "$program")
echo "$symbols" | has ' __stack_chk_fail' || lack 'no stack protector (__stack_chk_fail)'
echo "$symbols" | has '__glibcxx_assert_fail' || lack 'no _GLIBCXX_ASSERTIONS'
if [ "$release" = 1 ]; then
  echo "$symbols" | has ' __(mem|str|s|vs|sn|vsn|f)[a-z]*_chk' || lack 'no _FORTIFY_SOURCE (no _chk)'
fi
[ "$(grep -c -aF "$folder" "$program")" = 0 ] || lack "it holds the folder $folder"
[ $lacks = 0 ]
