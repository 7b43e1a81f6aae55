#!/bin/sh
# Numbers of finished biaxial runs with their spread: mean +- standard error over the run folders given.
# Usage: summary.sh DIR...   (folders of the same scene, one per seed)
set -eu
for dir in "$@"; do
  awk -F, '
    NR == 1 { for (c = 1; c <= NF; c++) { name = $c; sub(/\[.*/, "", name); column[name] = c } next }
    {
      e = $column["axial_strain"]; v = $column["volumetric_strain"]; q = $column["stress_ratio"]
      if (e == 0) {   # the last row before compression: the confined state
        z0 = $column["coordination"]; zb0 = $column["coordination_bearing"]; phi0 = $column["solid_fraction"]
        xx0 = $column["sigma_xx"]; yy0 = $column["sigma_yy"]
        next
      }
      last = e
      if (e >= 0.01 && e <= 0.03) { q1 += q; n1++ }
      if (e >= 0.04 && e <= 0.06) { q5 += q; v5 += v; n5++ }
      if (e >= 0.08 && e <= 0.10) { q9 += q; v9 += v; n9++ }
      if (e >= 0.15 && e <= 0.20) { q17 += q; v17 += v; n17++ }
      if (e >= 0.01) { slip += $column["mean_slip"]; z += $column["coordination"]; n++ }
      if (v > vmax) { vmax = v; evmax = e }
      if (v < vmin) vmin = v
      residual = $column["energy_residual"]
    }
    END {
      print "sigma_xx/p_confined", xx0 / 1e5
      print "sigma_yy/p_confined", yy0 / 1e5
      print "coordination_confined", z0
      print "coordination_bearing_confined", zb0
      print "solid_fraction_confined", phi0
      if (n1) print "stress_ratio_1-3%", q1 / n1
      if (n5) print "stress_ratio_4-6%", q5 / n5
      if (n9) print "stress_ratio_8-10%", q9 / n9
      if (n17) print "stress_ratio_15-20%", q17 / n17
      if (n5) print "volumetric_strain_4-6%", v5 / n5
      if (n9) print "volumetric_strain_8-10%", v9 / n9
      if (n17) print "volumetric_strain_15-20%", v17 / n17
      print "volumetric_strain_peak", vmax + 0
      print "axial_strain_at_that_peak", evmax + 0
      print "first_contraction", vmin + 0
      if (n) print "mean_slip/vR_from_1%", slip / n
      if (n) print "coordination_from_1%", z / n
      print "energy_residual", residual
    }' "$dir/series.csv"
done | awk '
  { if (!($1 in count)) order[++kinds] = $1; count[$1]++; sum[$1] += $2; square[$1] += $2 * $2 }
  END {
    printf "%-34s %12s %12s %5s\n", "quantity", "mean", "std. error", "runs"
    for (k = 1; k <= kinds; k++) {
      name = order[k]; n = count[name]; mean = sum[name] / n
      variance = n > 1 ? (square[name] - n * mean * mean) / (n - 1) : 0
      printf "%-34s %12.5g %12s %5d\n", name, mean, (n > 1 ? sprintf("%.2g", sqrt((variance > 0 ? variance : 0) / n)) : "-"), n
    }
  }'
