#!/bin/sh
# Runs the studies: `run.sh` all of them, `run.sh NAME...` some, `run.sh --short` a check of the whole chain in seconds.
# Finished runs are kept, interrupted ones are resumed. TALUS names the program, OUT the folder.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../accuracy-run}
mkdir -p "$out"

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  for study in "$here"/*.yaml; do
    "$talus" study "$study" -o "$out/plan-$(basename "$study" .yaml)" --plan
  done
  "$talus" study "$here/peel.yaml" -o "$out/peel" -q --set seeds=2 --set grains.count=200 --set pack.width=15e-3 \
    --set stages.0.ramp=1 --set stages.0.tolerance=0.03 --set stages.1.strain=0.002 \
    --set 'metrics=[{take: value, column: mean_slip, at: 0.002, within: 50%}]'
  test -s "$out/peel/study.csv" -a -s "$out/peel/figures/error_mean_slip_at_0.002.png"
  exit 0
fi

[ $# -gt 0 ] || set -- dt refresh peel exponent vR rate mass tolerance skin
for name in "$@"; do
  "$talus" study "$here/$name.yaml" -o "$out/$name"
done
