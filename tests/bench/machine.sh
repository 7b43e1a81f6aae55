#!/bin/sh
# What a measurement was made on, for the head of a file in tests/bench/results.
set -eu
lscpu | grep -E '^(Model name|CPU\(s\)|L1d cache|L2 cache|L3 cache)'
grep -o -w -E -m1 'avx512f|avx2' /proc/cpuinfo | sort -u | tail -1
"${CC:-gcc}" --version | head -1
date -u +%Y-%m-%d
