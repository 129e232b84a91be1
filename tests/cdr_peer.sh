#!/bin/bash
# cdr_peer.sh CDR_SAMPLES SOURCE_DIR WORK_DIR [SEED]: random types and values in CDR, read and written by the npm package @foxglove/rosmsg2-serialization.
# 77 (skipped) without npm or network.
set -eu
samples=$1 source=$2 work=$3 seed=${4:-$(date +%s)}
for tool in node npm; do
  command -v $tool >/dev/null || { echo "SKIPPED: there is no $tool"; exit 77; }
done
rm -rf "$work"
cp -r "$source/tests/cdr_peer" "$work"
cd "$work"
if ! npm ci --silent --no-audit --no-fund >npm.log 2>&1; then
  echo "SKIPPED: the npm packages cannot be fetched: $(tail -1 npm.log)"
  exit 77
fi
echo "seeds from $seed on; again by: cdr_peer.sh … $seed"
"$samples" "$seed" 2000 >samples.jsonl
node compare.js <samples.jsonl
