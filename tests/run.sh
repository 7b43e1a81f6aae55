#!/bin/sh
# run.sh BINARY...   Runs each test binary: one line with its result and time, what it said when it failed, a summary.
# Exit 1 when one failed. A program still at work after TEST_LIMIT seconds (600 unless given) has failed.
set -u
# Threads that wait for their turn by spinning make tests of threads ten times as long where the machine is busy.
export OMP_WAIT_POLICY="${OMP_WAIT_POLICY:-passive}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
trap 'exit 130' INT TERM
now() { date +%s%N; }
seconds() { awk "BEGIN { printf \"%.1f\", ($(now) - $1) * 1e-9 }"; }

start=$(now)
count=0
failed=
for binary; do
  count=$((count + 1))
  began=$(now)
  timeout "${TEST_LIMIT:-600}" "$binary" >"$log" 2>&1
  code=$?
  name=$(basename "$binary")
  cases=$(grep -c '^\[       OK \]' "$log")
  if [ $code = 0 ]; then
    printf 'ok      %-28s %3d cases %7s s\n' "$name" "$cases" "$(seconds "$began")"
  else
    failed="$failed $name"
    printf 'FAILED  %-28s exit %3d  %7s s\n' "$name" $code "$(seconds "$began")"
    grep -vE '^\[( RUN      |       OK |==========|----------)\]' "$log" | tail -n 100 | sed 's/^/    /'
  fi
done
if [ -n "$failed" ]; then
  echo "$count test programs, $(seconds "$start") s; failed:$failed"
  exit 1
fi
echo "$count test programs, $(seconds "$start") s; all passed"
