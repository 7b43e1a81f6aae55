#!/bin/sh
# Runs the experiment: `run.sh` everything (about three minutes of one core), `run.sh --short` a check of the whole chain in
# seconds. Finished runs are kept, interrupted ones are resumed. TALUS names the program, OUT the folder, SEEDS the
# samples (1 to 5).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../chains-run}
seeds=${SEEDS:-1 2 3 4 5}
mkdir -p "$out"

run() { # folder, settings...
  folder=$1
  shift
  resume=
  if [ -e "$out/$folder/checkpoint.h5" ]; then resume=--resume; fi
  "$talus" run "$here/../biaxial/demo.yaml" -o "$out/$folder" $resume --no-figures "$@"
}

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  run small-1 -q --set seed=2 --set grains.count=150 --set pack.width=13e-3 --set stages.0.ramp=1 --set stages.1.strain=0.01 \
    --set output.fields_every=0.2
  "$talus" measure "$out/small-1" --at 0.002,peak,last --over 0.002 --export contacts -q
  "$talus" measure "$out/small-1" --region 3e-3:10e-3,5e-3:20e-3 --window 0.002:0.008 -o "$out/inner" --no-figures -q
  sh "$here/summary.sh" "$out/small-1"
  exit 0
fi

for seed in $seeds; do
  run "biaxial-$seed" --set "seed=$seed" --set output.fields_every=0.2
  "$talus" measure "$out/biaxial-$seed" --at 0.001,peak,0.1
done
sh "$here/summary.sh" "$out"/biaxial-*
