#!/bin/sh
# faults.sh BINARY...   Runs the tests of faults in their long form and prints the table of what held. Exit 1 when one
# failed, after what it said.
set -u
FAULTS=long
FAULTS_TABLE=$(mktemp)
log=$(mktemp)
export FAULTS FAULTS_TABLE
trap 'rm -f "$log" "$FAULTS_TABLE"' EXIT
trap 'exit 130' INT TERM
failed=
for binary; do
  "$binary" >"$log" 2>&1 && continue
  failed="$failed $(basename "$binary")"
  grep -vE '^\[( RUN      |       OK |==========|----------)\]' "$log" | tail -n 100
done
printf '%-44s %9s  %s\n' case trials 'what held'
cat "$FAULTS_TABLE"
[ -z "$failed" ] || { echo "failed:$failed"; exit 1; }
