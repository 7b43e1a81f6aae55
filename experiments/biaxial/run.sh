#!/bin/sh
# Runs the experiment: `run.sh` everything (about 25 minutes of one core), `run.sh --short` a check of the whole
# chain in seconds. Finished runs are kept, interrupted ones are resumed. TALUS names the program, OUT the folder.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../biaxial-run}
mkdir -p "$out"

run() { # folder, scene file, settings...
  folder=$1 file=$2
  shift 2
  resume=
  if [ -e "$out/$folder/checkpoint.h5" ]; then resume=--resume; fi
  "$talus" run -t 1 "$here/$file" -o "$out/$folder" $resume "$@"
}

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  for scene in demo pressure; do
    run "$scene" "$scene.yaml" -q --no-figures --set seed=2 --set grains.count=150 --set pack.width=13e-3 --set stages.0.ramp=1 \
      --set stages.1.strain=0.01 --set output.fields_every=1
    "$talus" verify "$out/$scene"
  done
  sh "$here/summary.sh" "$out/demo" "$out/pressure"
  exit 0
fi

for seed in 1 2 3 4 5 6 7 8; do run "demo-$seed" demo.yaml --set "seed=$seed"; done
for seed in 1 2 3 4 5; do run "pressure-$seed" pressure.yaml --set "seed=$seed"; done
for seed in 1 2 3 4 5; do
  run "large-$seed" demo.yaml --set "seed=$seed" --set 'stages.1.integrator={scheme: verlet, dt: 1e-5}'
done
run fine-1 demo.yaml --set seed=1 --set 'stages.1.integrator={scheme: verlet, dt: 2e-6}'
for kind in demo pressure large fine; do
  echo "== $kind"
  sh "$here/summary.sh" "$out/$kind"-?
done
