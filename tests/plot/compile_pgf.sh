#!/usr/bin/env bash
# Sources of figures through TeX: each compiles, is as wide as its journal's column and as high as it
# says, and no name of an axis lies on another text. 77 where there is no TeX; with MBV_NO_SKIP 1.
#   compile_pgf.sh MBVERIFY SOURCE_DIR
set -euo pipefail
if ! command -v pdflatex >/dev/null || ! kpsewhich pgfplots.sty >/dev/null; then
  echo "no pdflatex with pgfplots: scripts/setup --tests installs it"
  [ -z "${MBV_NO_SKIP:-}" ] || exit 1
  exit 77
fi
mbverify=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$2"

# WORDS: those of a page with their boxes, "left right top bottom text".
words() {
  sed -nE 's|.*<word xMin="([0-9.]+)" yMin="([0-9.]+)" xMax="([0-9.]+)" yMax="([0-9.]+)">(.*)</word>|\1 \3 \2 \4 \5|p' "$1"
}

# FILE.tex WIDTH_MM
check() {
  local folder name wanted
  folder=$(dirname "$1") name=$(basename "$1" .tex)
  cat >"$folder/try.tex" <<TEX
\\documentclass{article}
\\usepackage{pgfplots}\\pgfplotsset{compat=1.16}
\\begin{document}
\\newsavebox\\figurebox\\sbox\\figurebox{\\input{$name.tex}\\unskip}
\\pdfpagewidth=\\wd\\figurebox \\pdfpageheight=\\dimexpr\\ht\\figurebox+\\dp\\figurebox\\relax
\\hoffset=-1in \\voffset=-1in
\\typeout{BOX \\the\\wd\\figurebox\\space\\the\\dimexpr\\ht\\figurebox+\\dp\\figurebox\\relax}
\\shipout\\vbox{\\hbox{\\usebox\\figurebox}}
\\end{document}
TEX
  (cd "$folder" && pdflatex -interaction=nonstopmode -halt-on-error try.tex >try.out 2>&1) ||
    { grep -A3 '^!' "$folder/try.out"; echo "$name does not compile"; return 1; }
  wanted=$(sed -nE 's/.* ([0-9.]+) mm wide and ([0-9.]+) mm high\./\1 \2/p' "$1")
  [ "${wanted% *}" = "$2" ] || { echo "$name: says $wanted, not $2 mm wide"; return 1; }
  sed -nE 's/^BOX ([0-9.]+)pt ([0-9.]+)pt$/\1 \2/p' "$folder/try.out" | awk -v wanted="$wanted" -v name="$name" '
    { split(wanted, mm); for (k = 1; k <= 2; ++k) if (($k / 72.27 * 25.4 - mm[k]) ^ 2 > 0.02 ^ 2) bad = 1
      if (bad) print name ": " $1 / 72.27 * 25.4 " x " $2 / 72.27 * 25.4 " mm, wanted " wanted }
    END { exit NR != 1 || bad }' || return 1
  pdftotext -bbox "$folder/try.pdf" "$folder/try.html"
  words "$folder/try.html" >"$folder/try.words"
  awk -v name="$name" '
    { l[NR] = $1; r[NR] = $2; t[NR] = $3; b[NR] = $4; w[NR] = $5 }
    END {
      for (i = 1; i <= NR; ++i) {
        if (w[i] != "Time") continue
        ++times
        for (k = 1; k <= NR; ++k) {
          if (k == i || l[k] > r[i] || r[k] < l[i] || t[k] > b[i] || b[k] < t[i]) continue
          print name ": \"Time\" lies on \"" w[k] "\""; bad = 1
        }
      }
      if (times > 1) { print name ": the common axis is named " times " times"; bad = 1 }
      exit bad
    }' "$folder/try.words" || return 1
  echo "$name: $wanted mm"
}

"$mbverify" figures stabilizing_platform/sea_state --formats pgf --out "$work/ieee" \
  --set motion.sample_s=0.1 >/dev/null  # TeX takes 12 s for 1200 points
"$mbverify" figures scara_robot/stiffness --style springer --formats pgf --out "$work/springer" >/dev/null
"$mbverify" figures --paper stabilizing_platform fig10 --formats pgf --out "$work/paper" >/dev/null
count=0
for figure in "$work"/ieee/*/*/*.tex "$work"/paper/*/*/*.tex; do
  check "$figure" 88.9
  count=$((count + 1))
done
figure=$(ls "$work"/springer/*/*/*.tex | head -1)  # one map
check "$figure" 84
[ "$count" -ge 7 ] || { echo "only $count figures"; exit 1; }

# A figure whose legend stands where the axis is named, and one that is wider, are found.
wrong=$work/ieee/stabilizing_platform/sea_state/drive_forces.tex
sed -E 's/^(.*xlabel=\{)\}/\1Time}/' "$wrong" >"$(dirname "$wrong")/named_twice.tex"
sed -E 's/rectangle \(252bp/rectangle (260bp/' "$wrong" >"$(dirname "$wrong")/wide.tex"
for faulty in named_twice wide; do
  if check "$(dirname "$wrong")/$faulty.tex" 88.9; then echo "$faulty was not found"; exit 1; fi
done
