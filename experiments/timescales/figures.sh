#!/bin/sh
# Figures answering P's 2.3-2.5 from the runs that are there: volumetric strain, mean slip and stress ratio against axial
# strain, thin lines for single runs, thick ones for their mean in bins of 0.1 % strain; the key says what has run.
# Usage: figures.sh RUNS-FOLDER
set -eu
out=${1:?figures.sh RUNS-FOLDER}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# strain and column of the compression in one run
curve() { # run, column
  awk -F, -v want="$2" '
    NR == 1 { for (c = 1; c <= NF; c++) { name = $c; sub(/\[.*/, "", name); column[name] = c } next }
    $column["axial_strain"] > 0 { print 100 * $column["axial_strain"], $column[want] }' "$1/series.csv"
}

# how far runs went, from the ends of their curves: "8 to 10 %" or "1 to 10 %, 1 to 2 %"
reach() { # curves
  for one; do tail -n 1 "$one"; done | awk '{ to = sprintf("%.0f", $1); n[to]++ }
    END { for (to in n) print to, n[to] }' | sort -rg | awk '{ printf "%s%d to %s %%", (NR > 1 ? ", " : ""), $2, $1 }'
}

draw() { # file, column, label, factor, group prefix of the runs' names
  plot=
  for kind in I II III ours; do
    case $kind in I) color="#d55e00" dash=2 ;; II) color="#009e73" dash=4 ;; III) color="#000000" dash=1 ;; *) color="#0072b2" dash=1 ;; esac
    count=0
    : > "$work/$kind"
    for run in "$out/$5$kind"-?; do
      [ -e "$run/series.csv" ] || continue
      count=$((count + 1))
      curve "$run" "$2" > "$work/$kind-$count"
      cat "$work/$kind-$count" >> "$work/$kind"
      plot="$plot, '$work/$kind-$count' using 1:(\$2*$4) with lines lc rgb '$color' lw 0.4 dt $dash notitle"
    done
    [ $count -gt 0 ] || continue
    # where fewer runs reach, the mean is theirs
    awk '{ b = int($1 / 0.1); s[b] += $2; n[b]++ } END { for (b in s) print 0.1 * (b + 0.5), s[b] / n[b] }' \
      "$work/$kind" | sort -g > "$work/$kind-mean"
    plot="$plot, '$work/$kind-mean' using 1:(\$2*$4) with lines lc rgb '$color' lw 2.5 dt $dash title '$kind ($(reach "$work/$kind"-?))'"
  done
  [ -n "$plot" ] || return 0
  gnuplot -e "set terminal pngcairo size 1200,800 font 'DejaVu Sans,22'; set output '$1'; set key outside top center horizontal;
    set xlabel 'axial strain (%)'; set ylabel '$3'; set grid lc rgb '#dddddd'; plot ${plot#,}"
  echo "$1"
}

mkdir -p "$out/figures"
for group in "" big-; do
  draw "$out/figures/${group}volumetric_strain.png" volumetric_strain "volumetric strain (%), dilation +" 100 "$group"
  draw "$out/figures/${group}mean_slip.png" mean_slip "mean slip / v_R" 1 "$group"
  draw "$out/figures/${group}stress_ratio.png" stress_ratio "stress ratio {/Symbol s}_{yy} / {/Symbol s}_{xx}" 1 "$group"
done
