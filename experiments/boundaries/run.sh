#!/bin/sh
# Runs the experiment: `run.sh` everything, `run.sh --short` a check of the whole chain in seconds. Finished runs are
# kept, interrupted ones are resumed. TALUS names the program, OUT the folder, SEEDS the samples (1 to 5).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../boundaries-run}
seeds=${SEEDS:-1 2 3 4 5}
mkdir -p "$out"

run() { # folder, scene file, settings...
  folder=$1 file=$2
  shift 2
  resume=
  if [ -e "$out/$folder/checkpoint.h5" ]; then resume=--resume; fi
  "$talus" run "$here/$file" -o "$out/$folder" $resume "$@"
}

# Every kind of boundary on one sample: a name for its folder and what follows `run`.
all() { # suffix of the folders, settings...
  suffix=$1
  shift
  run "pressure$suffix" pressure.yaml "$@"
  run "membrane$suffix" membrane.yaml "$@"
  run "penalty$suffix" penalty.yaml "$@"
  for order in 0 1 3; do run "exact-$order$suffix" exact.yaml --set "stages.1.order=$order" "$@"; done
}

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  small="-q --no-figures --set stages.0.ramp=0.5 --set stages.0.tolerance=0.2 --set stages.0.unbalanced=0.05
    --set stages.1.rate=0.05 --set stages.1.strain=0.01 --set output.fields_every=1"
  # shellcheck disable=SC2086
  all "" $small --set grains.count=150 --set pack.width=13e-3
  # shellcheck disable=SC2086
  for order in 0 3; do
    run "circle-$order" circle.yaml --set "stages.1.order=$order" $small --set grains.count=300 --set pack.width=22e-3 \
      --set pack.cut.radius=8e-3
  done
  for folder in "$out"/*/; do "$talus" verify "$folder"; done
  sh "$here/summary.sh" "$out"/*/
  exit 0
fi

for seed in $seeds; do all "-$seed" --set "seed=$seed"; done
for order in 0 1 3; do
  run "circle-$order" circle.yaml --set "stages.1.order=$order"
  for count in 2100 3970 5034; do # Fig. 3.13: the same shape of sample, larger and larger, to 10 %
    width=$(awk "BEGIN { printf \"%.6g\", 60e-3 * sqrt($count / 3279) }")
    run "size-$count-order-$order" exact.yaml --set "grains.count=$count" --set "pack.width=$width" \
      --set "stages.1.order=$order" --set stages.1.strain=0.10
  done
done
sh "$here/summary.sh" "$out"/*/
