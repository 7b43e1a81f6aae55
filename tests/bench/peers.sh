#!/bin/sh
# peers.sh BENCH_STEP [N ...]: Talus beside LAMMPS (Debian package lammps) on one core, spring friction, the same
# assembly, in turns; CPU time. Prints million grain-steps per second of both and their ratio, three pairs for each N.
set -eu
here=$(dirname "$0")
bench=$1
shift
[ $# -gt 0 ] || set -- 4000 100000
lmp=$(command -v lmp || true)
if [ -z "$lmp" ]; then
  echo "bench-peers: no lmp: apt install lammps"
  exit 0
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export OMP_NUM_THREADS=1
side() { awk -v key="$1" -v column="$2" '$3 == key { print $column }' "$work/data"; }
printf '%8s %12s %12s %8s\n' N "LAMMPS" "Talus" ratio
for n; do
  steps=$((8000000 / n + 5))
  "$bench" -w "$work/data" "$n"
  for pair in 1 2 3; do
    "$lmp" -in "$here/peers.in" -log "$work/log" -screen none -var data "$work/data" -var warm $((steps / 5 + 5)) \
      -var steps $steps -var x0 "$(side xlo 1)" -var x1 "$(side xlo 2)" -var y0 "$(side ylo 1)" -var y1 "$(side ylo 2)"
    # seconds of the last run times the share of a processor it had
    theirs=$(awk -v n="$n" '/^Loop time/ {t = $4; s = $9} /CPU use/ {u = $1 + 0} END {print n * s / (t * u / 100) * 1e-6}' \
      "$work/log")
    ours=$("$bench" -v spring "$n" | awk 'END {for (k = 1; k < NF; k++) if ($k == '"$n"') print $(k + 1)}')
    awk -v n="$n" -v a="$theirs" -v b="$ours" 'BEGIN {printf "%8d %12.1f %12.1f %8.2f\n", n, a, b, b / a}'
  done
done
