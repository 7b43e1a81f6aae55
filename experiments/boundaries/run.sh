#!/bin/sh
# Runs the experiment, then makes its figures and tables: `run.sh` everything, `run.sh PART...` some of: pressure membrane
# penalty exact circle size study. `run.sh --short` is a check of the whole chain in seconds. Finished runs are kept,
# interrupted ones are resumed. TALUS names the program, OUT the folder, SEEDS the samples (1 to 5), THREADS the threads
# of a run (1), PYTHON the interpreter that has h5py and matplotlib.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../boundaries-run}
python=${PYTHON:-/usr/bin/python3}
short='' sizes='2100 3970 5034' rows='' cut='' few=''
mkdir -p "$out"

run() { # folder, scene file, settings...
  folder=$out/$1 file=$2
  shift 2
  resume=
  if [ -e "$folder/checkpoint.h5" ]; then resume=--resume; fi
  # a run that went bad says why and leaves what it has; the others go on
  # shellcheck disable=SC2086 # words
  "$talus" run "$here/$file" -o "$folder" -t "${THREADS:-1}" -q --no-figures $resume "$@" $short ||
    { [ $? = 3 ] && [ -z "$short" ]; }
}

# shellcheck disable=SC2086 # words
part() { # name, seed
  case $1 in
  pressure | membrane | penalty) run "$1-$2" "$1.yaml" --set "seed=$2" $rows ;;
  exact) for order in 0 1 3; do
    run "order$order-$2" exact.yaml --set "seed=$2" --set "stages.1.order=$order" $rows
  done ;;
  circle) for order in 0 1 3; do
    run "circle-order$order-$2" circle.yaml --set "seed=$2" --set "stages.1.order=$order" $cut
  done ;;
  size) for count in $sizes; do # Fig. 3.13: the same shape of sample, larger and larger
    width=$(awk "BEGIN { printf \"%.6g\", 60e-3 * sqrt($count / 3279) }")
    for order in 0 1 3; do
      run "size$count-order$order-$2" exact.yaml --set "seed=$2" --set "grains.count=$count" \
        --set "pack.width=$width" --set "stages.1.order=$order" --set stages.1.strain=0.10
    done
  done ;;
  study)
    # shellcheck disable=SC2086 # words
    [ "$2" != 1 ] || "$talus" study "$here/study.yaml" -o "$out/study" -t "${THREADS:-1}" -q $few
    ;;
  *) echo "run.sh: no part $1" >&2 && exit 2 ;;
  esac
}

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  SEEDS='1 2' sizes=120
  short='--set stages.0.ramp=0.5 --set stages.0.tolerance=0.2 --set stages.0.unbalanced=0.05 --set stages.1.rate=0.05
    --set stages.1.strain=0.02 --set output.fields_every=0.05'
  set -- pressure membrane penalty exact circle size study
  rows='--set grains.count=150 --set pack.width=13e-3'
  cut='--set grains.count=300 --set pack.width=22e-3 --set pack.cut.radius=8e-3'
  few="$short $rows --set seeds=2"' --set dials.0.values=[{"label":"K","set":{"stages.1.method":"penalty"}}]
    --set metrics=[{"take":"mean","column":"strain_rate_error_yy","along":"time","from":0.6,"to":0.8}]'
fi

[ $# -gt 0 ] || set -- pressure membrane penalty exact circle size study
for seed in ${SEEDS:-1 2 3 4 5}; do
  for name in "$@"; do part "$name" "$seed"; done
done
if [ -n "$short" ]; then
  for folder in "$out"/*-?/; do "$talus" verify "$folder"; done
fi
"$python" "$here/figures.py" "$out"
"$python" "$here/table.py" "$out"
