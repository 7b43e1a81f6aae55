#!/bin/sh
# estimate.sh TALUS: how long `talus check` says that a scene takes, and how long it takes; one core, three scenes.
set -eu
talus=$1
scene=$(dirname "$0")/../../experiments/biaxial/demo.yaml
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export OMP_NUM_THREADS=1
short='--set stages.0.ramp=0.4 --set stages.0.tolerance=0.5 --set stages.0.unbalanced=1'

one() { # name, settings...
  name=$1
  shift
  # shellcheck disable=SC2086 # words
  said=$("$talus" check "$scene" $short "$@" | awk '/^time/ { print $(NF - 1) }')
  # shellcheck disable=SC2086
  "$talus" run "$scene" -t 1 -q --no-figures -o "$work/$name" $short "$@"
  took=$(awk -F'[:,]' '/"wall_time"/ { print $2 + 0; exit }' "$work/$name/run.json")
  awk -v name="$name" -v said="$said" -v took="$took" \
    'BEGIN { printf "%-22s %9.1f %9.1f %+7.0f %%\n", name, said, took, 100 * (said / took - 1) }'
}

printf '%-22s %9s %9s %9s\n' scene "said [s]" "took [s]" error
one implicit-983 --set stages.1.strain=0.03
one implicit-3970 --set grains.count=3970 --set pack.width=64e-3 --set stages.1.strain=0.01
one verlet-983 --set stages.1.strain=0.005 --set 'stages.1.integrator={scheme: verlet, dt: 2e-6}'
