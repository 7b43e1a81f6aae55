#!/bin/sh
# summary.sh RUN...   Mean and standard error over measured runs at their three instants of --at (before, at and after the
# peak), from the tables in RUN/measure.
set -eu
for dir; do
  m=$dir/measure
  at=$(awk -F, 'NR > 1 && !seen[$1]++ { printf "%s%s", sep, $1; sep = " " }' "$m/force_pdf.csv")
  awk -F, -v at="$at" -v run="$dir" '
    FNR == 1 { delete col; for (k = 1; k <= NF; k++) { name = $k; sub(/\[.*/, "", name); col[name] = k }
               file = FILENAME; sub(/.*\//, "", file); next }
    BEGIN { n = split(at, frames, " "); for (k = 1; k <= n; k++) place[frames[k]] = k }
    function put(label, value) { print run "," place[$1] "," label "," value }
    !($1 in place) { next }
    file == "tensors.csv" && $col["network"] == "all" {
      put("01 axial strain (%)", 100 * $3)
      put("02 stress ratio (s1 - s2)/(s1 + s2)", $col["stress_ratio"])
      put("03 the same as half the sum of anisotropies", $col["relation_ratio"])
      put("04 the same with their products", $col["relation_full_ratio"])
      put("05 a_c", $col["a_c"]); put("06 a_n", $col["a_n"]); put("07 a_t", $col["a_t"]); put("08 a_l", $col["a_l"]) }
    file == "tensors.csv" && $col["network"] == "strong" {
      put("09 a_c of strong contacts", $col["a_c"]); put("10 stress ratio of strong contacts", $col["stress_ratio"]) }
    file == "tensors.csv" && $col["network"] == "weak" { put("11 stress ratio of weak contacts", $col["stress_ratio"]) }
    file == "forces.csv" && $col["force"] == "normal" {
      put("12 share of contacts below the mean (%)", 100 * $col["below_mean"])
      put("13 tail exponent beta", $col["tail_rate"]); put("14 power-law exponent alpha", $col["power_exponent"])
      put("15 participation", $col["participation"]); put("16 mobilised friction", $col["mobilised"])
      put("17 contacts at the friction limit (%)", 100 * $col["at_friction_limit"]) }
    file == "chains.csv" {
      put("18 force chains", $col["chains"]); put("19 grains of a chain", $col["mean_grains"])
      put("20 share of bearing grains in chains (%)", 100 * $col["chain_grains"] / $col["bearing_grains"])
      put("21 segments buckled since the frame before (%)", $col["segments"] ? 100 * $col["buckled"] / $col["segments"] : 0) }
    file == "voids.csv" {
      put("22 coordination", $col["coordination"]); put("23 without rattlers", $col["coordination_bearing"])
      put("24 solid fraction", $col["solid_fraction"]); put("25 contacts around a void", $col["mean_sides"]) }
    file == "motion.csv" {
      if ($col["rotation_length"] > 0) put("26 rotation length (mean diameters)", $col["rotation_length_diameters"])
      put("27 median rotation (degrees)", $col["median_rotation"]) }
    file == "bands.csv" && $col["found"] == 1 {
      put($col["field"] == "shear" ? "28 width of the shear band (mean diameters)" : "30 width of the rotation band (mean diameters)",
          $col["width_diameters"])
      axis = $col["axis"]; if (axis > 90) axis = 180 - axis
      put($col["field"] == "shear" ? "29 axis of the shear band off the horizontal (degrees)" : "31 axis of the rotation band off the horizontal (degrees)", axis) }
  ' "$m/tensors.csv" "$m/forces.csv" "$m/chains.csv" "$m/voids.csv" "$m/motion.csv" "$m/bands.csv"
  awk -F, -v run="$dir" 'NR > 1 && $2 == 1 { print run ",3,persistence of " $1 " (next window)," $6 }' "$m/persistence.csv"
  awk -F, -v run="$dir" 'NR > 1 && !$11 && !$12 && $6 > 0 { n++; life += $7 - $6; buckled += $10 > 0 }
    END { if (n) { print run ",3,life time of a chain (% axial strain)," 100 * life / n
                   print run ",3,chains that ever buckled (%)," 100 * buckled / n } }' "$m/chain_lives.csv"
done | awk -F, '
  { key = $3; n[key, $2]++; sum[key, $2] += $4; square[key, $2] += $4 * $4; labels[key] = 1 }
  END {
    for (label in labels) {
      line = "| " label
      for (k = 1; k <= 3; k++) {
        c = n[label, k]
        if (!c) { line = line " | "; continue }
        m = sum[label, k] / c
        e = c > 1 ? sqrt((square[label, k] - c * m * m > 0 ? square[label, k] - c * m * m : 0) / (c - 1) / c) : 0
        line = line sprintf(" | %.3g ± %.2g (%d)", m, e, c)
      }
      print line " |"
    }
  }' | sort | sed 's/^| [0-9][0-9] /| /'
