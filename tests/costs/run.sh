#!/bin/sh
# run.sh COSTS [--write]: instructions per grain and step of each scene of costs.c (the program COSTS), counted by
# valgrind, beside those in expected.csv. A tenth more is a failure, and so is an effect that is named, nil and not free.
# --write renews expected.csv. Counts do not depend on the machine or its load, but on compiler and flags (MODE=costs).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
costs=$1 expected=$here/expected.csv
command -v valgrind > /dev/null || { echo "costs: valgrind not found (Debian package valgrind)" >&2; exit 1; }

if [ "${2:-}" = --count ]; then # name
  file=$(mktemp)
  valgrind -q --tool=callgrind --toggle-collect=measured_steps --callgrind-out-file="$file" "$costs" "$3"
  awk -v name="$3" '/^(totals|summary):/ { total = $2 } END { printf "\"%s\";%.1f\n", name, total / 250 / 1000 }' "$file"
  rm "$file"
  exit 0
fi

now=$(mktemp)
trap 'rm -f "$now"' EXIT
"$costs" | xargs -d '\n' -n 1 -P "$(nproc)" sh "$0" "$costs" --count > "$now.counts"
{
  echo "scene;instructions per grain and step"
  "$costs" | while read -r name; do grep -F "\"$name\";" "$now.counts"; done
} > "$now"
rm "$now.counts"
if [ "${2:-}" = --write ]; then cp "$now" "$expected"; fi

awk -F';' '
  function more(less, than) {
    if (!(now["\"" less "\""] > 0 && now["\"" less "\""] < now["\"" than "\""])) {
      print less ": not less than " than
      bad++
    }
  }
  FNR == 1 { file++; next }
  file == 1 { before[$1] = $2; next }
  {
    now[$1] = $2
    change = before[$1] ? 100 * ($2 / before[$1] - 1) : 0
    verdict = !before[$1] ? "  NEW" : (change > 10) ? "  TOO MANY" : ""
    printf "%-46s %7.1f %+6.1f %%%s\n", $1, $2, change, verdict
    bad += verdict != ""
  }
  END {
    # what is absent costs nothing: a scene with less in it takes fewer instructions
    more("hertz", "hertz, damping"); more("hertz", "hertz, regularised"); more("hertz", "hertz, spring")
    more("linear", "linear, damping"); more("hertz, damping", "hertz, damping, regularised")
    more("hertz, regularised", "hertz, damping, regularised")
    more("hertz, damping, regularised", "hertz, damping, regularised, rotation")
    more("hertz, damping, regularised, rotation", "the same, gravity")
    more("hertz, damping, regularised, rotation", "the same, two walls")
    more("hertz, damping, regularised, rotation", "the same, pressure")
    more("the same, pressure", "the same, membrane"); more("the same, pressure", "the same, minimal exact")
    more("the same, minimal exact", "the same, minimal of order 3")
    more("implicit regularised, damping", "implicit regularised, damping, pressure")
    bare = now["\"hertz\""]
    for (name in now)
      if (name ~ /^"nil |nothing to solve/ && (now[name] > 1.01 * bare)) {
        print name ": not free"
        bad++
      }
    if (bad) print "costs: " bad " failed"
    exit (bad > 0)
  }' "$expected" "$now"
