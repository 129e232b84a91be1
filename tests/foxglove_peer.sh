#!/bin/bash
# foxglove_peer.sh SENTREE SOURCE_DIR WORK_DIR: a run with --foxglove, seen by the npm package @foxglove/ws-protocol.
# 77 (skipped) without npm or network.
set -eu
sentree=$(realpath "$1") source=$(realpath "$2") work=$3
for tool in node npm; do
  command -v $tool >/dev/null || { echo "SKIPPED: there is no $tool"; exit 77; }
done
rm -rf "$work"
cp -r "$source/tests/foxglove_peer" "$work"
cd "$work"
if ! npm ci --silent --no-audit --no-fund >npm.log 2>&1; then
  echo "SKIPPED: the npm packages cannot be fetched: $(tail -1 npm.log)"
  exit 77
fi
node client.js "$sentree" "$source/examples/recharge" experiment1
