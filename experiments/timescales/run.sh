#!/bin/sh
# P's chapter 2: `run.sh` everything (the benchmark alone is several hours of one core), `run.sh NAME...` some of: study
# times ours I II III big big-III. `run.sh --short` is a check of the whole chain in seconds. Finished runs are kept,
# interrupted ones are resumed. TALUS names the program, OUT the folder.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../timescales-run}
scene=$here/../biaxial/demo.yaml
mkdir -p "$out"

run() { # folder, settings...
  folder=$out/$1
  shift
  resume=
  if [ -e "$folder/checkpoint.h5" ]; then resume=--resume; fi
  "$talus" run "$scene" -t 1 -o "$folder" $resume -q --no-figures --set output.fields_every=1 "$@"
}

I='stages.1.integrator={scheme: verlet, dt: 1e-5}'
II='stages.1.integrator={scheme: two_timescale, dt: 2e-7, m: 5, n: 5, q: 5}'
III='stages.1.integrator={scheme: verlet, dt: 2e-7}'

part() {
  case $1 in
  study) "$talus" study "$here/steps.yaml" -o "$out/steps" ;;
  times) "$talus" study "$here/times.yaml" -o "$out/times" -t 1 ;;
  ours) for s in 1 2 3 4 5 6 7 8; do run "ours-$s" --set "seed=$s"; done ;;
  I) for s in 1 2 3 4 5 6 7 8; do run "I-$s" --set "seed=$s" --set "$I"; done ;;
  II)
    run II-1 --set seed=1 --set stages.1.strain=0.05 --set "$II"
    run II-2 --set seed=2 --set stages.1.strain=0.02 --set "$II"
    ;;
  III) run III-1 --set seed=1 --set "$III" ;;
  big) for s in 1 2; do
    run "big-ours-$s" --set "seed=$s" --set grains.count=3970 --set pack.width=64e-3
    run "big-I-$s" --set "seed=$s" --set grains.count=3970 --set pack.width=64e-3 --set "$I"
  done ;;
  big-III) run big-III-1 --set seed=1 --set grains.count=3970 --set pack.width=64e-3 --set stages.1.strain=0.02 \
    --set "$III" ;;
  *) echo "run.sh: no part $1" >&2 && exit 2 ;;
  esac
}

draw() {
  sh "$here/figures.sh" "$out"
  "${PYTHON:-python3}" "$here/fluctuations.py" "$out" "$@"
}

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  small='--set grains.count=150 --set pack.width=13e-3 --set stages.0.ramp=1 --set stages.0.tolerance=0.03'
  for study in steps times; do
    # shellcheck disable=SC2086 # words
    "$talus" study "$here/$study.yaml" -o "$out/$study" -q $small --set seeds=2 --set stages.1.strain=2e-4 \
      --set 'metrics=[{take: value, column: mean_slip, at: 2e-4}]'
  done
  # shellcheck disable=SC2086
  run II-1 $small --set stages.1.strain=2e-3 --set "$II"
  # shellcheck disable=SC2086
  run ours-1 $small --set stages.1.strain=2e-3
  "$talus" verify "$out/II-1"
  draw 0:0.002
  test -s "$out/figures/fluctuations.png"
  exit 0
fi

[ $# -gt 0 ] || set -- study times ours I II III big big-III
for name in "$@"; do part "$name"; done
draw
