#!/bin/sh
# Runs the studies: `run.sh` all of them, `run.sh --short` a check of the whole chain in seconds. Finished runs are
# kept, interrupted ones are resumed. TALUS names the program, OUT the folder.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../accuracy-run}
mkdir -p "$out"

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  "$talus" study "$here/study-dt.yaml" -o "$out/dt" -q --set seeds=2 --set grains.count=100 --set pack.width=11e-3 \
    --set stages.0.ramp=0.5 --set stages.0.unbalanced=0.05 --set stages.0.tolerance=0.05 --set stages.1.strain=0.001 \
    --set 'reference={value: verlet 2e-6}' --set 'metrics=[{take: value, column: mean_slip, at: 0.001, within: 50%}]'
  test -s "$out/dt/study.csv" -a -s "$out/dt/figures/error_mean_slip_at_0.001.png"
  exit 0
fi

for study in "$here"/study-*.yaml; do
  name=$(basename "$study" .yaml)
  "$talus" study "$study" -o "$out/${name#study-}"
done
