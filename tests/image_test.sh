#!/usr/bin/env bash
# What the Dockerfile copies, laid out as in the image, is all that the command looks for beside itself.
# usage: image_test.sh SOURCE_DIR BUILD_DIR WORK_DIR
set -euo pipefail
source=$1 build=$2 work=$3
fail() { echo "✗ $*" && exit 1; }
rm -rf "$work" && mkdir -p "$work"

while read -r from to; do
  [[ $from == /sentree/* ]] || continue
  from=${from#/sentree/}
  if [[ $from == build/release/* ]]; then from=$build/${from#build/release/}; else from=$source/$from; fi
  mkdir -p "$work$(dirname "$to")"
  cp -r "$from" "$work$to"
done < <(sed -n 's/^COPY --from=build //p' "$source/Dockerfile")

cd "$work/opt/sentree/share/sentree"
for project in examples/recharge examples/nav2; do
  "$work/opt/sentree/bin/sentree" test "$project" >"$work/said" 2>&1 </dev/null || fail "sentree test $project: $(cat "$work/said")"
done
"$work/opt/sentree/bin/sentree" doctor >"$work/said" 2>&1 || true
grep -q "ROS 2 by Fast DDS" "$work/said" || fail "sentree doctor: $(cat "$work/said")"
