#!/usr/bin/env bash
# Ends of runs with nodes in C++ that do not come back: each is told, and comes in time.
# usage: hanging_nodes_test.sh SENTREE FOLDER_OF_PLUGINS WORK
set -euo pipefail
sentree=$1 plugins=$2 work=$3
rm -rf "$work"
mkdir -p "$work"

fail() {
  echo "$1" >&2
  cat "$work/out" >&2
  exit 1
}

# project PLUGIN TREE
project() {
  cat >"$work/sentree.yaml" <<END
mission: {file: mission.xml, rate: 50 Hz}
plugins: [$plugins/lib$1_plugin.so]
deadlines: {halt: 500 ms, unresponsive: 200 ms}
END
  echo "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">$2</BehaviorTree></root>" >"$work/mission.xml"
}

# ends CODE: what was started as $run ends by itself, so.
ends() {
  local code=0
  wait "$run" || code=$?
  [ "$code" = "$1" ] || fail "exit $code, not $1"
}

project hangs '<Hangs name="At the door"/>'
"$sentree" run "$work" --clock real --no-record >"$work/out" 2>&1 &
run=$!
until grep -q 'Hangs "At the door", a node in C++, was called at .* the mission stands until it does' "$work/out"; do
  kill -0 "$run" || fail "the run is over"
  sleep 0.05
done
kill -INT "$run"
ends 1
grep -q 'Hangs "At the door".*; the run ends without it' "$work/out" || fail "what it ends without is not told"

project threads '<Deaf/>'
"$sentree" run "$work" --clock real --no-record --duration '300 ms' >"$work/out" 2>&1 &
run=$!
ends 124
grep -q 'a thread of a node in C++ (Deaf) works on 2 s after the run' "$work/out" || fail "the thread is not told"
