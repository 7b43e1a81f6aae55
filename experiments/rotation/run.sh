#!/bin/sh
# Runs the experiment: `run.sh` every part, `run.sh PART...` some of them (one, steps, ensemble, dials), `run.sh --short`
# a check of the whole chain in seconds. Finished runs are kept, interrupted ones are resumed. TALUS names the program,
# OUT the folder, SEEDS the samples, GRAINS the forced grains of each, THREADS how many runs at a time.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
talus=${TALUS:-$here/../../build/talus}
out=${OUT:-$here/../../rotation-run}
seeds=${SEEDS:-1 2 3 4 5}
grains=${GRAINS:-40}
threads=${THREADS:-$(nproc)}
settings='stages.0.pressure=25e3 stages.0.pressure=400e3 material.friction=0.2 material.friction=0.8
  contact.exponent=5 contact.exponent=50'
margin=10 # mean diameters between forced grains and the rim
reach=10
mkdir -p "$out"

run() { # folder, settings...
  folder=$1
  shift
  resume=
  if [ -e "$out/$folder/checkpoint.h5" ]; then resume=--resume; fi
  "$talus" run "$here/forced.yaml" -o "$out/$folder" $resume "$@"
}

# The confined state alone, for what begins from it.
confined() { # folder, settings...
  folder=$1
  shift
  run "$folder" "$@" --set 'stages=[{kind: confine, pressure: 100e3, ramp: 4.0, friction: 0.1, tolerance: 0.02}]'
}

# P Figs. 4.4 and 4.5.
one() {
  run one "$@"
  "$talus" rotation "$out/one" --reach "$reach"
}

# The same turn, ten times as fast and a fifth as long, with implicit friction and explicitly at small steps.
steps() {
  confined confined -t 1
  for how in implicit_friction:1e-4 implicit_friction:1e-5 verlet:1e-6 verlet:3e-7; do
    run "steps/${how%:*}-${how#*:}" -t 1 --no-figures --from "$out/confined" --set stages.1.omega=0.3 \
      --set stages.1.ramp=0.1 --set stages.1.hold=0.02 --set "stages.1.integrator.scheme=${how%:*}" \
      --set "stages.1.integrator.dt=${how#*:}"
    "$talus" rotation "$out/steps/${how%:*}-${how#*:}" --since 0 --reach "$reach" --no-figures
  done
}

ensemble() {
  for seed in $seeds; do
    run "ensemble/seed-$seed" -t "$threads" --set "seed=$seed" "$@" \
      --set "stages.1.grain={random: $grains, margin: $margin}"
  done
  "$talus" rotation "$out/ensemble" --reach "$reach" --network 0
  "$talus" rotation "$out/ensemble" --reach "$reach" | tee "$out/ensemble/summary.txt"
}

# Pressure, friction and exponent, one at a time: friction and exponent from the confinement on.
dials() {
  for set in $settings; do
    for seed in $seeds; do
      run "dials/$set/seed-$seed" -t "$threads" --no-figures --set "seed=$seed" --set "$set" "$@" \
        --set "stages.1.grain={random: $grains, margin: $margin}"
    done
    echo "$set"
    "$talus" rotation "$out/dials/$set" --reach "$reach" --no-figures | tee "$out/dials/$set/summary.txt"
  done
  if [ -e "$out/ensemble/summary.txt" ]; then "${PYTHON:-/usr/bin/python3}" "$here/dials.py" "$out"; fi
}

if [ "${1:-}" = --short ]; then
  trap 'rm -rf "$out"' EXIT
  margin=2 reach=4 grains=3 seeds="1 2" settings=material.friction=0.8
  small="-q --no-figures --set grains.count=300 --set pack.width=22e-3 --set pack.cut.radius=8e-3 --set stages.0.ramp=0.5
    --set stages.0.unbalanced=0.02 --set stages.0.tolerance=0.2 --set stages.1.ramp=0.1 --set stages.1.hold=0.05"
  # shellcheck disable=SC2086
  one $small
  # shellcheck disable=SC2086
  ensemble $small
  # shellcheck disable=SC2086
  dials $small
  for folder in "$out/one" "$out"/ensemble/seed-*/ "$out"/ensemble/seed-*/runs/*/; do "$talus" verify "$folder"; done
  exit 0
fi

for part in ${*:-one steps ensemble dials}; do "$part"; done
