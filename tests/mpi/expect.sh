#!/bin/sh
# expect.sh SETTINGS CODE WORDS RANKS PROGRAM [ARGUMENT…]: runs the program on that many ranks (0: without mpirun) and
# succeeds if it ends with the exit code and prints the words (a regular expression, any case; with ^ and $ once only).
# SPDX-License-Identifier: BSD-3-Clause
# shellcheck source=/dev/null
. "$1"
code=$2 words=$3 ranks=$4
shift 4
if [ "$ranks" != 0 ]; then set -- timeout -k 10 600 mpirun --timeout 400 -n "$ranks" "$@"; fi
output=$("$@" 2>&1)
got=$?
printf '%s\n' "$output"
if [ "$got" != "$code" ]; then
  echo "exit code $got instead of $code"
  exit 1
fi
times=$(printf '%s\n' "$output" | grep -ci -- "$words")
case $words in
  ^*$) wanted=1 ;;
  *) wanted=$((times > 0 ? times : 1)) ;;
esac
if [ "$times" != "$wanted" ]; then
  echo "it prints $times times: $words"
  exit 1
fi
