#!/bin/sh
# may_hang.sh NAME COMMAND…: runs a test after which mpirun itself may hang (parallel/README.md). Where CAROM_REPEATED
# names a file, a test that fails runs a second time, and its name and what it printed the first time are appended there.
# SPDX-License-Identifier: BSD-3-Clause
name=$1
shift
if [ -z "$CAROM_REPEATED" ]; then exec "$@"; fi
first=$(mktemp)
trap 'rm -f "$first"' EXIT
"$@" >"$first" 2>&1
code=$?
cat "$first"
if [ "$code" = 0 ]; then exit 0; fi
echo "$name failed with exit code $code and runs a second time:"
"$@"
second=$?
{
  echo "$name: exit code $code the first time, $second the second time. The first time it printed:"
  sed 's/^/  /' "$first"
} >>"$CAROM_REPEATED"
exit "$second"
