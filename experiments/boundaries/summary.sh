#!/bin/sh
# One line per finished run: strain reached, stress ratio and volumetric strain over the last half of the strain, peak of
# the volumetric strain, largest errors of the imposed rates over the rate asked for, grains outside, ledger, cost.
# Usage: summary.sh DIR...
set -eu
printf '%-22s %8s %8s %9s %9s %9s %9s %7s %9s %9s\n' run strain ratio vol vol_peak at error outside residual 'ms/step'
for dir in "$@"; do
  rate=$(sed -n 's/.*"scene".*//; s/.*rate: \([-0-9.e]*\).*/\1/p' "$dir/run.json" | head -n 1)
  cost=$(awk -F'[:,]' '/"wall_time"/ { wall = $2 } /"steps"/ && !steps { steps = $2 } END { print (steps > 0 ? 1e3 * wall / steps : 0) }' "$dir/run.json")
  awk -F, -v name="$(basename "$dir")" -v cost="$cost" -v rate="${rate:-0}" '
    function size(value) { return value < 0 ? -value : value }
    NR == 1 { for (c = 1; c <= NF; c++) { key = $c; sub(/\[.*/, "", key); column[key] = c } next }
    {
      strain = size($column["shear_strain"]); if ($column["axial_strain"] > strain) strain = $column["axial_strain"]
      if (strain == 0) next
      e[++n] = strain; q[n] = $column["stress_ratio"]; v[n] = $column["volumetric_strain"]
      if (n == 1 || v[n] > peak) { peak = v[n]; at = strain }
      for (k = 1; k <= 3; k++) {
        text = $column[k == 1 ? "strain_rate_error_xx" : k == 2 ? "strain_rate_error_yy" : "strain_rate_error_xy"]
        if (text != "nan" && size(text) > error) error = size(text)
      }
      if ($column["outside"] > outside) outside = $column["outside"]
      residual = $column["energy_residual"]
    }
    END {
      for (k = 1; k <= n; k++) if (e[k] > 0.5 * e[n]) { qs += q[k]; vs += v[k]; m++ }
      printf "%-22s %8.4f %8.4f %9.5f %9.5f %9.4f %9.2g %7d %9.1e %9.3f\n", name, e[n], qs / m, vs / m, peak, at,
        error / (rate > 0 ? rate : 1), outside, residual, cost
    }' "$dir/series.csv"
done
