#!/usr/bin/env bash
# scripts/abi sees that a library lost functions, and finds nothing where nothing changed.
# usage: abi_test.sh SOURCE_DIR BUILD_DIR WORK_DIR
set -euo pipefail
source=$1 build=$2 work=$3
command -v abidiff >/dev/null || { echo "skipped: there is no abidiff (apt-get install abigail-tools)" && exit 77; }
fail() { echo "✗ $*" && exit 1; }

rm -rf "$work"
for library in base bt exec; do
  mkdir -p "$work/src/$library"
  cp "$build/src/$library/libsentree_$library.a" "$work/src/$library/"
done
said=$("$source/scripts/abi" --built "$build" "$work") || fail "the same libraries differ: $said"
[[ $said == *"surface is the same"* ]] || fail "of the same libraries it says: $said"

# Where sources are compiled many at once, the object has more functions than that one.
object=$(nm -A --defined-only "$work/src/bt/libsentree_bt.a" 2>/dev/null | sed -n 's/^[^:]*:\([^:]*\):.*write_models.*/\1/p' | head -n 1)
ar d "$work/src/bt/libsentree_bt.a" "${object:?no object has write_models}"
status=0
said=$("$source/scripts/abi" --built "$build" "$work") || status=$?
((status == 1)) || fail "functions are missing, and the exit code is $status: $said"
[[ $said == *"write_models"* ]] || fail "it does not name what is missing: $said"
status=0
"$source/scripts/abi" no-such-revision >"$work/said" 2>&1 || status=$?
[[ $status == 4 && $(cat "$work/said") == *'no revision "no-such-revision"'* ]] || fail "an unknown revision: $status, $(cat "$work/said")"
echo "all good"
