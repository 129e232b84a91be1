#!/bin/sh
# run_mcap.sh SENTREE SOURCE_DIR FOLDER: a recording of ours, read by the MCAP reader of the standard's authors (npm, pinned by
# the lock file): uncut, with Zstandard; every message, attachment and checksum. 77 (skipped) without network or npm.
set -eu
sentree=$1
source=$2
folder=$3
mkdir -p "$folder"
cd "$folder"
cp "$source/conformance/record/package.json" "$source/conformance/record/package-lock.json" "$source/conformance/record/read_mcap.mjs" .
if ! command -v npm >/dev/null; then echo "SKIPPED: npm is not installed, so the reader cannot be fetched"; exit 77; fi
if ! npm ci --silent --ignore-scripts >/dev/null 2>&1; then echo "SKIPPED: no network, so the reader cannot be fetched"; exit 77; fi

"$sentree" run "$source/examples/recharge" --scenario experiment1 --clock virtual --json --record run.mcap >report.json || true
read=$(node read_mcap.mjs run.mcap)
echo "$read"
observations=$(sed -n 's/.*"observations":\([0-9]*\).*/\1/p' report.json)
case $read in
  *"\"/observations\":$observations,"*) ;;
  *) echo "not all of the $observations observations are there"; exit 1 ;;
esac
for part in /tree /charts /monitors /robot/pose /robot/scan /map /scene /snapshots /log; do
  case $read in *"\"$part\":"*) ;; *) echo "$part is missing"; exit 1 ;; esac
done

# What is changed must be found out. In three places: an index between two chunks has no checksum.
cp run.mcap altered.mcap
for quarter in 1 2 3; do
  printf 'changed' | dd of=altered.mcap bs=1 seek=$(($(wc -c <run.mcap) * quarter / 4)) conv=notrunc 2>/dev/null
done
if node read_mcap.mjs altered.mcap >/dev/null 2>&1; then echo "an altered recording was not found out"; exit 1; fi
echo "the altered recording was found out"
