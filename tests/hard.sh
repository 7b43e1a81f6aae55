#!/bin/sh
# hard.sh BINARY...   Runs the hard cases and prints their table. The form is that of HARD (plain or long). Exit 1 when a
# case failed; what it said stands below the table.
set -u
export OMP_WAIT_POLICY="${OMP_WAIT_POLICY:-passive}"
log=$(mktemp)
trap 'rm -f "$log" "$log.failed"' EXIT
trap 'exit 130' INT TERM
: >"$log.failed"
echo '| case | dial | what must hold | measured | limit found | beyond it |'
echo '|---|---|---|---|---|---|'
for binary; do
  "$binary" >"$log" 2>&1 || { echo "$(basename "$binary"):"; grep -vE '^\[( RUN      |       OK |==========|----------)\]|^\|' "$log"; } \
    >>"$log.failed"
  grep '^|' "$log"
done
[ -s "$log.failed" ] || exit 0
echo
echo 'FAILED:'
cat "$log.failed"
exit 1
