#!/bin/sh
# demo.sh [TALUS]   Runs demo.yaml into demo-run at the project's top and says where the pictures are. An interrupted
# demo goes on; a finished one is made anew. Only a folder that this script made (it holds .demo) is ever removed.
set -eu
talus=$(realpath "${1:-build/talus}")
cd "$(dirname "$0")/../.."
scene=experiments/biaxial/demo.yaml
out=demo-run
n=1
while [ -e "$out" ] && [ ! -e "$out/.demo" ]; do
  n=$((n + 1))
  out=demo-run-$n
done

code=2
if [ -e "$out/checkpoint.h5" ] && ! grep -q '"status": "done"' "$out/run.json" 2>/dev/null; then
  echo "talus: going on with the interrupted run in $out"
  code=0
  "$talus" run "$scene" -o "$out" --resume || code=$?
fi
if [ $code = 2 ]; then # a new run, or one that cannot be resumed because its scene or the program has changed
  rm -rf "$out"
  mkdir "$out"
  touch "$out/.demo"
  echo "talus run $scene -o $out"
  code=0
  "$talus" run "$scene" -o "$out" || code=$?
fi
[ $code != 75 ] || echo "talus: or simply: make demo" >&2
[ $code = 0 ] || exit $code

echo
echo "The curves and pictures are in $out/figures:"
for file in "$out"/figures/*; do echo "  $file"; done
echo "The numbers behind them: $out/series.csv (docs/formats.md says what each column is)."
