#!/bin/sh
# expect.sh SETTINGS CODE WORDS RANKS PROGRAM [ARGUMENT…]: runs the program on that many ranks (0: without mpirun) and
# succeeds if it ends with the exit code and says the words.
. "$1"
code=$2 words=$3 ranks=$4
shift 4
if [ "$ranks" != 0 ]; then set -- timeout -k 10 60 mpirun --timeout 40 -n "$ranks" "$@"; fi
said=$("$@" 2>&1)
got=$?
printf '%s\n' "$said"
if [ "$got" != "$code" ]; then
  echo "exit code $got instead of $code"
  exit 1
fi
case $said in
  *"$words"*) ;;
  *)
    echo "it does not say: $words"
    exit 1
    ;;
esac
