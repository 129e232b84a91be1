#!/usr/bin/env bash
# The command as its users meet it: exit codes, data on standard output, messages on standard error.
# usage: cli_test.sh SENTREE SOURCE_DIR WORK_DIR
set -euo pipefail
sentree=$1 source=$2 work=$3
rm -rf "$work" && mkdir -p "$work" && cd "$source"
export XDG_RUNTIME_DIR=$work
failures=0

# expect CODE PATTERN COMMAND…: the command exits with CODE, and its output (both streams) matches PATTERN.
expect() {
  local code=$1 pattern=$2 got=0
  shift 2
  "$@" >"$work/out" 2>&1 </dev/null || got=$?
  if [[ $got -ne $code ]]; then
    echo "✗ $* exited with $got, expected $code:" && tail -5 "$work/out" && failures=$((failures + 1))
  elif ! grep -qE -- "$pattern" "$work/out"; then
    echo "✗ $*: nothing matches $pattern:" && tail -5 "$work/out" && failures=$((failures + 1))
  else
    echo "✓ $*"
  fi
}

expect 0 'sentree run examples/recharge' "$sentree" run --help
expect 2 'subcommand' "$sentree"
expect 2 'subcommand is required' "$sentree" notacommand
expect 3 'no such file; a project is a folder with a sentree.yaml' "$sentree" run "$work/nothing"
expect 3 'no scenario "experimnt1"; did you mean "experiment1"' "$sentree" run examples/recharge --scenario experimnt1
expect 0 'nothing to complain about' "$sentree" check examples/recharge
expect 0 '"errors":0' "$sentree" check examples/minimal --json

# Experiment 1: exit 1, verdict, monitor and witness as JSON, the same bytes each time.
expect 1 '"monitor":"battery","verdict":"violated".*"witness":\[\{' \
  "$sentree" run examples/recharge --scenario experiment1 --clock virtual --seed 7 --json
cp "$work/out" "$work/first"
"$sentree" run examples/recharge --scenario experiment1 --clock virtual --seed 7 --json >"$work/second" || true
cmp "$work/first" "$work/second" || failures=$((failures + 1))
"$sentree" run examples/recharge --scenario recharge --clock virtual --verbose >"$work/log1"
"$sentree" run examples/recharge --scenario recharge --clock virtual --verbose >"$work/log2"
cmp "$work/log1" "$work/log2" || failures=$((failures + 1))

expect 0 '^\{"scenarios":\[\{"name":"empty-battery","ok":true' "$sentree" test examples/minimal --json
expect 3 'no scenario "vist"; did you mean "visit"' "$sentree" test examples/minimal --scenario vist
expect 124 'ended by its time limit' "$sentree" run examples/recharge --clock virtual --duration '5 s'

# A new project runs.
expect 0 'mission.xml' "$sentree" init "$work/mine"
expect 3 'not empty' "$sentree" init "$work/mine"
expect 0 '2 of 2 scenarios held' "$sentree" test "$work/mine"

expect 0 '<svg' "$sentree" graph examples/recharge
expect 0 'stateDiagram-v2' "$sentree" graph examples/recharge/skills/GoToLocation.scxml --to mermaid
expect 0 'unix sockets' "$sentree" doctor

# Parts elsewhere: gone in mid-run, not there at all, a port that is taken.
expect 0 'GoToStation: FAILURE .*unreachable' "$sentree" run tests/scenarios/peer-gone.yaml
expect 0 'GoToKitchen: FAILURE .*unreachable' "$sentree" run tests/scenarios/skill-gone.yaml
expect 4 'no mission runs' "$sentree" call battery getBatteryState

"$sentree" component sim --world examples/recharge/world/world.yaml --listen tcp://127.0.0.1:0 >"$work/component" &
component=$!
trap 'kill $component 2>/dev/null || true' EXIT
until grep -q 'listening on' "$work/component" || ! kill -0 $component 2>/dev/null; do read -rt 0.05 <> <(:) || true; done
address=$(sed -n 's/listening on //p' "$work/component")
expect 0 '"percentage":' "$sentree" call "$address/battery" getBatteryState --interface robot.thrift/Battery
expect 2 'no method "getBatery' "$sentree" call "$address/battery" getBateryState --interface robot.thrift/Battery
expect 2 'begins with none of the known schemes' "$sentree" call http://here getBatteryState
expect 4 'taken|in use' "$sentree" component sim --world examples/recharge/world/world.yaml --listen "$address"
expect 4 'insecure' "$sentree" component sim --world examples/recharge/world/world.yaml --listen tcp://0.0.0.0:0
kill $component

# Experiment 1 by hand: a mission in real time, the battery forced through its control socket.
"$sentree" run examples/recharge --clock real --factor 20 --duration '60 s' >"$work/mission" 2>&1 &
mission=$!
until "$sentree" call simulation setBatteryCharge percent=10 >"$work/call" 2>&1 || ! kill -0 $mission 2>/dev/null; do :; done
until grep -q 'battery violated' "$work/mission" || ! kill -0 $mission 2>/dev/null; do read -rt 0.05 <> <(:) || true; done
kill -INT $mission 2>/dev/null || true
code=0
wait $mission || code=$?
[[ $code -eq 130 || $code -eq 1 ]] || { echo "✗ the interrupted mission exited with $code" && failures=$((failures + 1)); }
grep -q 'OK' "$work/call" && grep -q 'battery violated' "$work/mission" || {
  echo "✗ experiment 1 by hand:" && cat "$work/call" "$work/mission" && failures=$((failures + 1))
}

if [[ $failures -gt 0 ]]; then echo "$failures failed" && exit 1; fi
